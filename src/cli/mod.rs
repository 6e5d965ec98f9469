//! The command line: its arguments, the launcher it runs under, and what it says about itself.

pub mod args;
pub mod fit;
pub mod init;
pub mod isolated_reader;
pub mod launch;
pub mod rank_watchdog;
pub mod results;
pub mod versions;
