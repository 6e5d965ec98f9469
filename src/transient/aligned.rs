//! Numbers in whole cache lines: products of short columns that begin anywhere take up to a third longer.

use std::cell::RefCell;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u64; 8]);

/// Numbers of type `T` in a line.
const fn per_line<T>() -> usize {
    size_of::<Line>() / size_of::<T>()
}

/// `n` numbers of type `T` rounded up to whole lines.
pub(super) fn padded_len<T>(n: usize) -> usize {
    n.next_multiple_of(per_line::<T>())
}

/// Numbers that fill whole lines; those after the ones that are meant are 0.
#[derive(Debug, Clone, Default)]
pub(super) struct AlignedVec<T>(Vec<Line>, PhantomData<T>);

/// Lines of vectors whose memory goes from one to the next. A step has some forty vectors that live for a part of it:
/// memory on the borders of lines from the allocator would take a tenth of its time.
const SHORT: usize = 512;

/// Most vectors whose memory is kept.
const KEPT: usize = 64;

thread_local! {
    static FREE: RefCell<Vec<Vec<Line>>> = const { RefCell::new(Vec::new()) };
}

impl<T> Drop for AlignedVec<T> {
    fn drop(&mut self) {
        if (1..=SHORT).contains(&self.0.capacity()) {
            // At the end of a thread there may be no place to keep it any more.
            let _ = FREE.try_with(|free| {
                let mut free = free.borrow_mut();
                if free.len() < KEPT {
                    free.push(std::mem::take(&mut self.0));
                }
            });
        }
    }
}

impl<T: Pod> AlignedVec<T> {
    /// `n` zeros, rounded up.
    pub(super) fn zeros(n: usize) -> Self {
        let lines = n.div_ceil(per_line::<T>());
        let mut memory = match lines {
            1..=SHORT => FREE.try_with(|free| free.borrow_mut().pop()).ok().flatten().unwrap_or_default(),
            _ => Vec::new(),
        };
        memory.clear();
        memory.resize(lines, Line::zeroed());
        Self(memory, PhantomData)
    }

    /// The first `n` of these numbers, rounded up, and zeros where there are not as many.
    pub(super) fn resized(mut self, n: usize) -> Self {
        self.0.resize(n.div_ceil(per_line::<T>()), Line::zeroed());
        self
    }

    /// Columns of `rows` numbers each, every one in lines of its own.
    pub(super) fn columns(rows: usize, mut numbers: impl ExactSizeIterator<Item = T>) -> Self {
        let stride = padded_len::<T>(rows);
        let mut lines = Self::zeros(numbers.len() / rows.max(1) * stride);
        for column in lines.chunks_exact_mut(stride.max(1)) {
            column[..rows].iter_mut().zip(&mut numbers).for_each(|(to, from)| *to = from);
        }
        lines
    }
}

impl<T: Pod> Deref for AlignedVec<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        bytemuck::cast_slice(&self.0)
    }
}

impl<T: Pod> DerefMut for AlignedVec<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

impl<T: Pod, I: ExactSizeIterator<Item = T>> From<I> for AlignedVec<T> {
    fn from(numbers: I) -> Self {
        let mut lines = Self::zeros(numbers.len());
        lines.iter_mut().zip(numbers).for_each(|(to, from)| *to = from);
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_at_a_line_and_zeros_fill_the_last() {
        for n in [0, 1, 15, 16, 17, 89] {
            let lines = AlignedVec::from((0..n).map(|i| i as f32 + 1.0));
            assert_eq!(lines.len(), padded_len::<f32>(n));
            assert_eq!(lines.as_ptr().addr() % 64, 0);
            assert!((0..n).all(|i| lines[i] == i as f32 + 1.0) && lines[n..].iter().all(|v| *v == 0.0));
            let more = lines.resized(n + 20);
            assert!(more.len() == padded_len::<f32>(n + 20) && more[n..].iter().all(|v| *v == 0.0));
        }
        let columns = AlignedVec::columns(3, (1..7).map(f64::from));
        assert_eq!(columns[..], [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
