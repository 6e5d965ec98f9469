//! Command line of railsqueal.
fn main() {}
