//! Published virtual surface lights into pictures on the CPU, and the path-traced reference.
