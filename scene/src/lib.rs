//! Turns scene files into meshes, materials, lights, a camera and a ray-tracing structure.
#![forbid(unsafe_code)]

pub mod bvh;
