//! Built-in crowned annular cylinder.
