//! Stability of steady sliding: which modes grow (formulation section 6).

pub mod reduced;
