//! Turns a frame into 64-bit words, what changed since another frame into fewer, and both back.

use bytemuck::Pod;
use photonstream_protocol::{ArrayKind, CHUNK_RECORDS, VslFrame};
use std::sync::Arc;

/// Arrays of a frame.
const ARRAYS: usize = ArrayKind::ALL.len();
/// Words of a frame beside its arrays: epoch, frame, publish time, simulated time, configuration, scene hash, and bytes of
/// the scene text and of the notice.
const HEAD: usize = 8;
const TEXT_BYTES: usize = 6;
const NOTICE_BYTES: usize = 7;

/// A frame as words, array by array.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct FrameWords {
    head: [u64; HEAD],
    arrays: [Vec<u64>; ARRAYS],
}

impl FrameWords {
    /// Makes it the words of `frame`.
    pub(crate) fn set(&mut self, frame: &VslFrame) {
        self.head = [
            frame.epoch,
            frame.frame,
            frame.publish_time_ns,
            frame.simulation_time_s.to_bits(),
            frame.config_generation,
            frame.scene_hash,
            frame.scene_text.len() as u64,
            frame.notice.len() as u64,
        ];
        let statistics = std::slice::from_ref(&frame.statistics);
        let [vsls, objects, lights, counters, text, notice, patches, distances] = &mut self.arrays;
        copy(vsls, &frame.vsls);
        copy(objects, &frame.objects);
        copy(lights, &frame.lights);
        copy(counters, statistics);
        copy_text(text, &frame.scene_text);
        copy_text(notice, &frame.notice);
        copy(patches, &frame.patches);
        copy(distances, &frame.distances);
    }

    /// Appends what differs from `previous` to `out`: the head, and of each array its number of records, its changed
    /// chunks, and these themselves, combined with the previous ones by exclusive or so that what stayed is zero.
    pub(crate) fn encode(&self, previous: &Self, out: &mut Vec<u64>) {
        out.extend_from_slice(&self.head);
        for (kind, (new, old)) in ArrayKind::ALL.into_iter().zip(self.arrays.iter().zip(&previous.arrays)) {
            let record = kind.record_bytes() / 8;
            let step = CHUNK_RECORDS * record;
            let old_chunk =
                |c: usize| old.get(c * step..).map_or(&[][..], |rest| &rest[..rest.len().min(step)]);
            out.push((new.len() / record) as u64);
            let count = out.len();
            out.push(0);
            for (c, chunk) in new.chunks(step).enumerate() {
                if chunk != old_chunk(c) {
                    out.push(c as u64);
                    out[count] += 1;
                }
            }
            let changed = count + 1..out.len();
            for at in changed {
                let c = out[at] as usize;
                let chunk = &new[c * step..new.len().min((c + 1) * step)];
                let before = old_chunk(c).iter().copied().chain(std::iter::repeat(0));
                out.extend(chunk.iter().zip(before).map(|(new, old)| new ^ old));
            }
        }
    }

    /// Applies what `encode` wrote to the previous frame. The error says what is impossible in it; the words are of no
    /// frame then.
    pub(crate) fn decode(&mut self, mut words: &[u64]) -> Result<(), String> {
        let head = take(&mut words, HEAD)?;
        self.head.copy_from_slice(head);
        for (kind, array) in ArrayKind::ALL.into_iter().zip(&mut self.arrays) {
            let record = kind.record_bytes() / 8;
            let step = CHUNK_RECORDS * record;
            let &[records, changed] = take(&mut words, 2)? else { return Err("no array".into()) };
            // Each word that was not there before is among those that follow: no file demands more memory than it fills.
            let most = array.len() + words.len();
            let length = usize::try_from(records).ok().and_then(|records| records.checked_mul(record));
            let length = length
                .filter(|length| *length <= most)
                .ok_or_else(|| format!("{records} {} records in {most} words", kind.name()))?;
            array.resize(length, 0);
            let chunks = take(&mut words, usize::try_from(changed).unwrap_or(usize::MAX))?;
            for &c in chunks {
                let begin =
                    usize::try_from(c).ok().and_then(|c| c.checked_mul(step)).filter(|begin| *begin < length);
                let begin = begin
                    .ok_or_else(|| format!("chunk {c} of {} {} records", length / record, kind.name()))?;
                let target = &mut array[begin..length.min(begin + step)];
                let source = take(&mut words, target.len())?;
                target.iter_mut().zip(source).for_each(|(word, change)| *word ^= change);
            }
        }
        if words.is_empty() { Ok(()) } else { Err(format!("{} words too many", words.len())) }
    }

    /// Makes `frame` what these words say; texts that stay the same stay the same allocation.
    pub(crate) fn write_to(&self, frame: &mut VslFrame) -> Result<(), String> {
        let [epoch, number, publish_time_ns, simulation_time, config_generation, scene_hash, ..] = self.head;
        let [vsls, objects, lights, counters, text, notice, patches, distances] = &self.arrays;
        frame.vsls = records(vsls);
        frame.chunk_frames.clear();
        frame.chunk_frames.extend(frame.vsls.iter().step_by(CHUNK_RECORDS).map(|vsl| vsl.changed_frame));
        frame.patches = records(patches);
        // Nothing is known of when they changed.
        frame.patch_chunk_frames.clear();
        frame.distances = records(distances);
        frame.distance_chunk_frames.clear();
        frame.objects = records(objects);
        frame.lights = records(lights);
        frame.statistics = records(counters).first().copied().ok_or("no statistics")?;
        write_text(&mut frame.scene_text, text, self.head[TEXT_BYTES])?;
        write_text(&mut frame.notice, notice, self.head[NOTICE_BYTES])?;
        (frame.epoch, frame.frame, frame.publish_time_ns) = (epoch, number, publish_time_ns);
        frame.simulation_time_s = f64::from_bits(simulation_time);
        (frame.config_generation, frame.scene_hash) = (config_generation, scene_hash);
        Ok(())
    }
}

fn copy<T: Pod>(words: &mut Vec<u64>, records: &[T]) {
    words.clear();
    words.extend_from_slice(bytemuck::cast_slice(records));
}

fn copy_text(words: &mut Vec<u64>, text: &str) {
    words.clear();
    words.resize(text.len().div_ceil(64) * 8, 0);
    bytemuck::cast_slice_mut(words)[..text.len()].copy_from_slice(text.as_bytes());
}

fn records<T: Pod>(words: &[u64]) -> Vec<T> {
    bytemuck::cast_slice(words).to_vec()
}

fn write_text(text: &mut Arc<str>, words: &[u64], bytes: u64) -> Result<(), String> {
    let all: &[u8] = bytemuck::cast_slice(words);
    let found = usize::try_from(bytes).ok().and_then(|bytes| all.get(..bytes));
    let found = found.ok_or_else(|| format!("a text of {bytes} bytes in {}", all.len()))?;
    if found != text.as_bytes() {
        *text = Arc::from(std::str::from_utf8(found).map_err(|e| format!("a text that is no UTF-8 ({e})"))?);
    }
    Ok(())
}

fn take<'a>(words: &mut &'a [u64], count: usize) -> Result<&'a [u64], String> {
    let (taken, rest) = words.split_at_checked(count).ok_or("too few words")?;
    *words = rest;
    Ok(taken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_protocol::VslRecord;

    fn words(vsls: usize, flux: f32, text: &str) -> FrameWords {
        let vsls = vec![VslRecord { flux: [flux; 3], ..VslRecord::default() }; vsls];
        let mut words = FrameWords::default();
        words.set(&VslFrame { vsls, scene_text: text.into(), ..VslFrame::default() });
        words
    }

    #[test]
    fn changes_of_contents_and_of_extents_are_found_again() {
        let steps = [
            words(200, 1.0, "a"),
            words(200, 1.0, "a"),
            words(200, 2.0, "a longer text"),
            words(70, 2.0, &"x".repeat(5000)),
            words(64, 2.0, ""),
            words(0, 0.0, "ä"),
            words(300, 3.0, "ä"),
        ];
        let (mut previous, mut replayed) = (FrameWords::default(), FrameWords::default());
        let mut lengths = Vec::new();
        for step in &steps {
            let mut out = Vec::new();
            step.encode(&previous, &mut out);
            replayed.decode(&out).unwrap();
            assert_eq!(&replayed, step);
            previous.clone_from(step);
            lengths.push(out.len());
        }
        assert_eq!(lengths[1], HEAD + 2 * ARRAYS, "nothing changed");
    }

    #[test]
    fn impossible_words_are_refused() {
        let mut out = Vec::new();
        words(100, 1.0, "a").encode(&FrameWords::default(), &mut out);
        for (at, value) in
            [(HEAD, u64::MAX), (HEAD + 1, u64::MAX), (HEAD + 1, 3), (HEAD + 2, 9), (HEAD + 3, u64::MAX)]
        {
            let mut bad = out.clone();
            bad[at] = value;
            assert!(FrameWords::default().decode(&bad).is_err(), "word {at} = {value}");
        }
        for length in 0..out.len() {
            assert!(FrameWords::default().decode(&out[..length]).is_err(), "{length} of {}", out.len());
        }
        out.push(0);
        assert!(FrameWords::default().decode(&out).is_err());
    }

    /// More records than there are words for are refused before anything is allocated.
    #[test]
    fn records_without_words_are_refused() {
        let mut head = vec![0; HEAD];
        let record = ArrayKind::ALL[0].record_bytes() / 8;
        for records in [1, 1 << 26, u64::MAX / record as u64 + 2] {
            head.truncate(HEAD);
            head.extend([records, 0]);
            let mut words = FrameWords::default();
            let error = words.decode(&head).unwrap_err();
            assert!(error.starts_with(&format!("{records} vsl records in 0 words")), "{error}");
            assert_eq!(words.arrays[0].capacity(), 0);
        }
    }
}
