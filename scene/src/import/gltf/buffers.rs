//! Turns the buffers of a glTF file into bytes: its own chunk, data URIs, and files beside it.

use super::Beside;
use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use gltf::json::Root;
use percent_encoding::percent_decode_str;
use std::borrow::Cow;

/// Padding is often left out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of all buffers, each cut to its length.
///
/// # Errors
/// A sentence on the buffer that cannot be read, or is shorter than it should be.
pub(super) fn load<'b>(
    root: &Root,
    bin: Option<Cow<'b, [u8]>>,
    beside: &mut Beside<'_>,
) -> Result<Vec<Cow<'b, [u8]>>, String> {
    let mut bin = bin;
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let at = |problem: String| format!("buffer {index}: {problem}");
        let mut bytes = match &buffer.uri {
            Some(uri) => Cow::Owned(read_uri(uri, beside).map_err(at)?),
            None if index == 0 => {
                bin.take().ok_or_else(|| at("it has no uri, and the file no binary chunk".into()))?
            }
            None => return Err(at("it has no uri; the binary chunk is buffer 0".into())),
        };
        let length = buffer.byte_length.0;
        if length > bytes.len() as u64 {
            return Err(at(format!("found {} bytes, expected {length}", bytes.len())));
        }
        match &mut bytes {
            Cow::Borrowed(bytes) => *bytes = &bytes[..length as usize],
            Cow::Owned(bytes) => bytes.truncate(length as usize),
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The content of a data URI or of a file beside the one that names it.
///
/// # Errors
/// If it is neither, or cannot be read.
pub(super) fn read_uri(uri: &str, beside: &mut Beside<'_>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (head, text) = data.split_once(',').ok_or("its data URI has no comma")?;
        if head.ends_with(";base64") {
            return BASE64.decode(text).map_err(|e| format!("its data URI is not base64 ({e})"));
        }
        return Ok(percent_decode_str(text).collect());
    }
    if let Some((scheme, _)) = uri.split_once(':') {
        let scheme: String = scheme.chars().take(20).collect();
        return Err(format!(
            "found a URI of scheme \"{scheme}\", expected data or the name of a file beside it"
        ));
    }
    let name = percent_decode_str(uri).decode_utf8().map_err(|_| "its URI is not UTF-8")?;
    beside.read(&name)
}
