//! Pure light-transport maths: sampling, lights, kernels, cameras, tone maps; no state.
