//! The photonstream command: starts and watches the processes, one subcommand a task.
