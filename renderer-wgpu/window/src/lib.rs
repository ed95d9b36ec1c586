//! Turns a running simulation into a window: what the GPU renderer draws, and hands for camera, lights and objects.
#![forbid(unsafe_code)]
