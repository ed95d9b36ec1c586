//! Turns a stream of bytes into messages: four bytes of length (little-endian), then that many bytes of JSON.

/// Greatest message, in bytes.
pub(crate) const MAX_MESSAGE: usize = 256 * 1024;

/// What the bytes received so far start with.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Next {
    /// A whole message, now removed from the buffer.
    Message(Vec<u8>),
    /// Part of a message.
    Incomplete,
    /// A length beyond the limit: the stream cannot be followed any further.
    TooLong(usize),
}

/// Takes the next message out of a buffer.
pub(crate) fn take_message(buffer: &mut Vec<u8>) -> Next {
    let Some((length, _)) = buffer.split_first_chunk::<4>() else { return Next::Incomplete };
    let length = u32::from_le_bytes(*length) as usize;
    if length > MAX_MESSAGE {
        return Next::TooLong(length);
    }
    if buffer.len() < 4 + length {
        return Next::Incomplete;
    }
    let message = buffer[4..4 + length].to_vec();
    buffer.drain(..4 + length);
    Next::Message(message)
}

/// Appends a message to a buffer; false if it is too long.
pub(crate) fn put_message(buffer: &mut Vec<u8>, message: &[u8]) -> bool {
    if message.len() > MAX_MESSAGE {
        return false;
    }
    // At most 256 KiB, see above.
    buffer.extend_from_slice(&(message.len() as u32).to_le_bytes());
    buffer.extend_from_slice(message);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_out_whole_from_any_split() {
        let mut stream = Vec::new();
        let messages: Vec<Vec<u8>> = [0, 1, 5, MAX_MESSAGE].iter().map(|n| vec![7; *n]).collect();
        for message in &messages {
            assert!(put_message(&mut stream, message));
        }
        for step in [1, 3, 4, 4096] {
            let (mut buffer, mut found) = (Vec::new(), Vec::new());
            for part in stream.chunks(step) {
                buffer.extend_from_slice(part);
                while let Next::Message(message) = take_message(&mut buffer) {
                    found.push(message);
                }
            }
            assert!(found == messages && buffer.is_empty());
        }
    }

    #[test]
    fn too_long_messages_are_refused_at_once() {
        assert!(!put_message(&mut Vec::new(), &vec![0; MAX_MESSAGE + 1]));
        let mut buffer = (MAX_MESSAGE as u32 + 1).to_le_bytes().to_vec();
        assert_eq!(take_message(&mut buffer), Next::TooLong(MAX_MESSAGE + 1));
    }
}
