//! The command line: its arguments, the launcher it runs under, and what it says about itself.

pub mod args;
pub mod init;
pub mod launch;
pub mod neighbour;
pub mod probe;
pub mod results;
pub mod versions;
