//! The tables of a result by their paths.

use super::super::table::Table;
use super::super::values::Values;
use num_complex::Complex64;

/// Tables that a run has made so far.
pub(super) struct Tables<'t>(pub(super) &'t [Table]);

impl Tables<'_> {
    fn table(&self, path: &str) -> Option<&Table> {
        self.0.iter().find(|table| table.path == path)
    }

    /// True if there is such a table.
    pub(super) fn has(&self, path: &str) -> bool {
        self.table(path).is_some()
    }

    /// True if a path begins so.
    pub(super) fn has_group(&self, begin: &str) -> bool {
        self.0.iter().any(|table| table.path.starts_with(begin))
    }

    /// Unit of a table; empty without it.
    pub(super) fn units(&self, path: &str) -> &str {
        self.table(path).map_or("", |table| &table.units)
    }

    /// Columns of a table of two dimensions; 0 of others.
    pub(super) fn columns(&self, path: &str) -> usize {
        self.table(path).and_then(|table| table.shape.get(1)).copied().unwrap_or(0)
    }

    /// Numbers of a table; empty without it.
    pub(super) fn numbers(&self, path: &str) -> Vec<f64> {
        match self.table(path).map(|table| &table.values) {
            Some(Values::F64(v)) => v.clone(),
            Some(Values::F32(v)) => v.iter().map(|&x| f64::from(x)).collect(),
            Some(Values::I8(v)) => v.iter().map(|&x| f64::from(x)).collect(),
            Some(Values::U8(v)) => v.iter().map(|&x| f64::from(x)).collect(),
            Some(Values::I32(v)) => v.iter().map(|&x| f64::from(x)).collect(),
            Some(Values::I64(v)) => v.iter().map(|&x| x as f64).collect(),
            _ => Vec::new(),
        }
    }

    /// Complex numbers of a table; empty without it.
    pub(super) fn complexes(&self, path: &str) -> &[Complex64] {
        match self.table(path).map(|table| &table.values) {
            Some(Values::Complex(v)) => v,
            _ => &[],
        }
    }

    /// Texts of a table; empty without it.
    pub(super) fn texts(&self, path: &str) -> &[String] {
        match self.table(path).map(|table| &table.values) {
            Some(Values::Text(v)) => v,
            _ => &[],
        }
    }
}
