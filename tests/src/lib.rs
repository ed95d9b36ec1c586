//! What crosses processes: kill, restart, swap, reload.
