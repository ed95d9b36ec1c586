//! Turns named layers of linear radiance into EXR and PNG files, and EXR files back into layers.
#![forbid(unsafe_code)]
