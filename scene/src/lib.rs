//! Scene files into meshes, materials, lights, camera and a ray-tracing structure.
