//! A dense symmetric operator on a few contact nodes, stored so that products with it are fast.

/// The leading `size` rows and columns of a symmetric matrix held column after column.
#[derive(Debug, Clone, Copy)]
pub struct Operator<'a> {
    /// Columns, `[stride * columns]`.
    data: &'a [f64],
    stride: usize,
    size: usize,
}

impl<'a> Operator<'a> {
    /// Columns of the length `stride` in `data`, of which the leading `size` by `size` block is meant.
    pub fn new(data: &'a [f64], stride: usize, size: usize) -> Self {
        Self { data, stride, size }
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Column (and row) `j`, `[size]`.
    pub fn col(&self, j: usize) -> &'a [f64] {
        &self.data[self.stride * j..][..self.size]
    }

    /// out = A x; columns where a node's three components are all 0 cost nothing.
    pub fn times(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.add(x, out);
    }

    /// out += A x.
    pub fn add(&self, x: &[f64], out: &mut [f64]) {
        for (b, v) in x.chunks_exact(3).enumerate() {
            if v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0 {
                continue;
            }
            let (c0, c1, c2) = (self.col(3 * b), self.col(3 * b + 1), self.col(3 * b + 2));
            for (((o, a), b), c) in out.iter_mut().zip(c0).zip(c1).zip(c2) {
                *o += a * v[0] + b * v[1] + c * v[2];
            }
        }
    }
}
