//! Turns world-space triangles into a structure that answers closest-hit and occlusion queries.
