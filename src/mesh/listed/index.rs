//! Position of each node by its number in the file.

use std::collections::HashMap;

/// Position of each node by its number: a table where the numbers lie close together, as they mostly do.
pub(in crate::mesh) enum Index {
    Dense(u64, Vec<u32>),
    Sparse(HashMap<u64, u32>),
}

impl Default for Index {
    fn default() -> Self {
        Index::Dense(0, Vec::new())
    }
}

impl Index {
    /// Fails with the position of the first number that occurs for the second time.
    pub fn new(tags: &[u64]) -> Result<Self, usize> {
        let low = tags.iter().min().copied().unwrap_or(0);
        let span = tags.iter().max().map_or(0, |high| high - low);
        if span < 8 * tags.len() as u64 + 1024 {
            let mut at = vec![u32::MAX; span as usize + 1];
            for (i, &tag) in tags.iter().enumerate() {
                if std::mem::replace(&mut at[(tag - low) as usize], i as u32) != u32::MAX {
                    return Err(i);
                }
            }
            return Ok(Index::Dense(low, at));
        }
        let mut at = HashMap::with_capacity(tags.len());
        for (i, &tag) in tags.iter().enumerate() {
            if at.insert(tag, i as u32).is_some() {
                return Err(i);
            }
        }
        Ok(Index::Sparse(at))
    }

    /// The position of the node with the number `tag`.
    pub fn get(&self, tag: u64) -> Option<u32> {
        match self {
            Index::Dense(low, at) => {
                at.get(usize::try_from(tag.checked_sub(*low)?).ok()?).copied().filter(|&i| i != u32::MAX)
            }
            Index::Sparse(at) => at.get(&tag).copied(),
        }
    }
}
