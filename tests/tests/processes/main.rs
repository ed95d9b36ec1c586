//! The command as its users meet it: processes that start, crash, come back and end, and what they say.
#![allow(clippy::unwrap_used)]

mod default_run;
mod dynamic;
mod edits;
mod ending;
mod giving_up;
mod gpu;
mod harness;
mod kills;
mod main_job;
mod messages;
mod models;
mod notices;
mod placing;
mod plug_ins;
mod replay;
mod reports;
mod set;
