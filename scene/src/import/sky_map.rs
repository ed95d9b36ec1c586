//! Turns an OpenEXR or Radiance HDR picture into the radiances of a sky.

use exr::prelude as exr_rs;
use exr_rs::{ReadChannels, ReadLayers};
use image::{DynamicImage, ImageDecoder, Limits, codecs::hdr::HdrDecoder};
use std::io::Cursor;

/// Most texels of a sky: 2²⁵, 8192 × 4096. Each takes 16 bytes: 512 MiB.
pub(crate) const MAX_TEXELS: u64 = 1 << 25;

/// Largest radiance of a texel, W m⁻² sr⁻¹.
const MAX_RADIANCE: f32 = 1e15;

/// Linear RGB radiances of a picture, row by row from its top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Radiances {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) texels: Vec<[f32; 3]>,
}

/// Reads a picture of either format, told apart by how they begin. Alpha does not count.
///
/// # Errors
/// If it is neither, is damaged or cut off, has more than [`MAX_TEXELS`] texels, or one that is negative, not finite or
/// beyond all reason.
pub(crate) fn read_radiances(bytes: &[u8]) -> Result<Radiances, String> {
    const EXR: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    let radiances = if bytes.starts_with(&EXR) {
        exr(bytes)?
    } else if bytes.starts_with(b"#?") {
        hdr(bytes)?
    } else {
        return Err("it is neither an OpenEXR (.exr) nor a Radiance (.hdr) picture".into());
    };
    let is_wrong = |t: &[f32; 3]| !t.iter().all(|c| (0.0..=MAX_RADIANCE).contains(c));
    let wrong = radiances.texels.iter().filter(|t| is_wrong(t)).count();
    if let Some(first) = radiances.texels.iter().position(is_wrong) {
        let (x, y) = (first as u32 % radiances.width, first as u32 / radiances.width);
        let [r, g, b] = radiances.texels[first];
        return Err(format!(
            "{wrong} of its {} texels are negative, not finite or above {MAX_RADIANCE:e}; the first is ({r}, {g}, {b}) at column \
             {x}, row {y}",
            radiances.texels.len()
        ));
    }
    Ok(radiances)
}

fn check_size(width: u64, height: u64) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(0) => Err(format!("it has no texels: {width} × {height}")),
        Some(count) if count <= MAX_TEXELS => Ok(()),
        _ => Err(format!("{width} × {height} texels are more than {MAX_TEXELS}; scale it down")),
    }
}

fn exr(bytes: &[u8]) -> Result<Radiances, String> {
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        check_size(header.layer_size.0 as u64, header.layer_size.1 as u64)?;
    }
    let image = exr_rs::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.0, vec![[0f32; 3]; size.area()]),
            |(width, texels), at, (r, g, b): (f32, f32, f32)| texels[at.1 * *width + at.0] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let (size, (_, texels)) = (image.layer_data.size, image.layer_data.channel_data.pixels);
    Ok(Radiances { width: size.0 as u32, height: size.1 as u32, texels })
}

fn hdr(bytes: &[u8]) -> Result<Radiances, String> {
    let mut decoder = HdrDecoder::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into())?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(16 * MAX_TEXELS);
    decoder.set_limits(limits).map_err(|e| e.to_string())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?.into_rgb32f();
    let texels = picture.into_raw().as_chunks().0.to_vec();
    Ok(Radiances { width, height, texels })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use exr_rs::WritableImage;
    use image::{ImageFormat, Rgb, Rgb32FImage};
    use proptest::prelude::*;

    fn texel(x: usize, y: usize) -> [f32; 3] {
        [x as f32, 0.5 * y as f32, 2.0]
    }

    fn exr_of(width: usize, height: usize, texel: impl Sync + Fn(usize, usize) -> [f32; 3]) -> Vec<u8> {
        let channels = exr_rs::SpecificChannels::rgb(|at: exr_rs::Vec2<usize>| {
            let [r, g, b] = texel(at.0, at.1);
            (r, g, b)
        });
        let mut bytes = Cursor::new(Vec::new());
        exr_rs::Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn hdr_of(width: u32, height: u32) -> Vec<u8> {
        let picture = Rgb32FImage::from_fn(width, height, |x, y| Rgb(texel(x as usize, y as usize)));
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(picture).write_to(&mut bytes, ImageFormat::Hdr).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn both_formats_give_their_texels() {
        let expected: Vec<_> = (0..12).map(|i| texel(i % 4, i / 4)).collect();
        for bytes in [exr_of(4, 3, texel), hdr_of(4, 3)] {
            let found = read_radiances(&bytes).unwrap();
            assert_eq!((found.width, found.height), (4, 3));
            // RGBE keeps these small whole and half numbers exactly: eight bits below the largest channel.
            assert_eq!(found.texels, expected);
        }
    }

    #[test]
    fn what_is_no_radiance_is_told_with_its_place() {
        for bad in [f32::NAN, f32::INFINITY, -0.5, 1e16] {
            let bytes = exr_of(4, 3, |x, y| if (x, y) == (2, 1) { [1.0, bad, 0.0] } else { texel(x, y) });
            let error = read_radiances(&bytes).unwrap_err();
            assert!(error.contains("1 of its 12 texels") && error.contains("column 2, row 1"), "{error}");
        }
        assert!(read_radiances(b"P6 1 1 255").unwrap_err().contains("neither"));
        let error = read_radiances(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n").unwrap_err();
        assert!(error.contains("60000 × 60000 texels are more than 33554432"), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..Default::default() })]

        /// Cut off or with other bytes anywhere, a picture is read or refused, never a panic. 256 cases; the generator's seed
        /// is random.
        #[test]
        fn damaged_pictures_do_no_harm(at in 0.0..1.0f64, byte: u8, cut: bool, is_exr: bool) {
            let mut bytes = if is_exr { exr_of(9, 5, texel) } else { hdr_of(9, 5) };
            let at = (at * bytes.len() as f64) as usize;
            if cut {
                bytes.truncate(at);
                prop_assert!(read_radiances(&bytes).is_err());
            } else {
                bytes[at] = byte;
                let _ = read_radiances(&bytes);
            }
        }
    }
}
