//! Turns a folder into one with a glTF file of plates full of holes, and into the text of a scene of them.

use std::{fmt::Write, path::Path};

/// Three plates above a floor of 5 m × 3 m. One mask of 7 × 5 texels of every alpha between 0 and 1, so that outlines of holes run
/// between texels; coordinates from −1.3 to 2.4, turned, scaled and moved by the texture's transform. The plates repeat, mirror
/// and clamp it, each another way along its columns and its rows, and cut it at alphas of their own. Without `holes` the plates
/// are opaque.
pub(crate) fn scene_text(folder: &Path, holes: bool) -> String {
    let alpha = |x: u32, y: u32| ((x * 97 + y * 59 + x * y * 31) % 256) as u8;
    let mask = image::RgbaImage::from_fn(7, 5, |x, y| image::Rgba([220, 200, 180, alpha(x, y)]));
    mask.save(folder.join("mask.png")).expect("the folder can be written to");
    let corners = [[-0.6f32, 0.0, 0.6], [0.6, 0.0, 0.6], [0.6, 0.0, -0.6], [-0.6, 0.0, -0.6]];
    let uvs = [[-1.3f32, -0.7], [2.4, -0.7], [2.4, 1.9], [-1.3, 1.9]];
    let floats = corners.as_flattened().iter().chain(uvs.as_flattened());
    let mut bytes: Vec<u8> = floats.flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    std::fs::write(folder.join("fence.bin"), &bytes).expect("the folder can be written to");
    let mode = if holes { "MASK" } else { "OPAQUE" };
    let (mut materials, mut meshes) = (String::new(), String::new());
    for (i, cutoff) in [0.5, 0.35, 0.62].into_iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        let cutoff = if holes { format!(r#""alphaCutoff":{cutoff},"#) } else { String::new() };
        let _ = write!(
            materials,
            r#"{comma}{{"name":"plate{i}","alphaMode":"{mode}",{cutoff}"doubleSided":true,"pbrMetallicRoughness":{{
            "baseColorTexture":{{"index":{i},"extensions":{{"KHR_texture_transform":
            {{"offset":[0.2,-0.4],"rotation":0.5,"scale":[1.3,0.8]}}}}}}}}}}"#
        );
        let _ = write!(
            meshes,
            r#"{comma}{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":{i}}}]}}"#
        );
    }
    let gltf = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_texture_transform"],"scene":0,
        "scenes":[{{"nodes":[0,1,2]}}],
        "nodes":[{{"mesh":0,"translation":[-1.4,0.7,0]}},{{"mesh":1,"translation":[0,0.8,0]}},
            {{"mesh":2,"translation":[1.4,0.7,0],"rotation":[0.2588190,0,0,0.9659258]}}],
        "meshes":[{meshes}],"materials":[{materials}],"images":[{{"uri":"mask.png"}}],
        "textures":[{{"sampler":0,"source":0}},{{"sampler":1,"source":0}},{{"sampler":2,"source":0}}],
        "samplers":[{{"wrapS":10497,"wrapT":33648}},{{"wrapS":33648,"wrapT":33071}},{{"wrapS":33071,"wrapT":10497}}],
        "buffers":[{{"uri":"fence.bin","byteLength":92}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
            {{"buffer":0,"byteOffset":80,"byteLength":12}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-0.6,0,-0.6],"max":[0.6,0,0.6]}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}]}}"#
    );
    let path = folder.join("fence.gltf");
    std::fs::write(&path, gltf).expect("the folder can be written to");
    format!(
        "[camera]\nposition_m = [0.3, 2.6, 3.4]\ntarget_m = [0, 0.2, 0.1]\nvertical_fov_deg = 55\n\
         [material.grey]\nalbedo = 0.7\n\
         [object.floor]\nmaterial = \"grey\"\n\
         quad = {{ corner_m = [-2.5, 0, 1.5], edge_u_m = [5, 0, 0], edge_v_m = [0, 0, -3] }}\n\
         [object.fence]\ngltf = {{ path = {path:?} }}\n\
         [light.lamp]\npower_w = 40\npoint = {{ position_m = [0.1, 2.3, 0.2] }}\n\
         [streaming]\nvsls = 300\npool_paths = 16384\n"
    )
}
