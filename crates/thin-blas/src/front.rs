//! The Fortran interface, and what lies behind it.

use std::cell::RefCell;
use std::ffi::{c_char, c_int, c_void, CStr};
use std::slice;
use std::sync::OnceLock;

use pulp::x86::V3;

use crate::kernel::{self, Product, COLUMNS};
use crate::triangle::{Triangle, LARGEST};

/// `dgemm` as Fortran has it; the lengths of the two words come last.
type Dgemm = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_int,
    *const c_int,
    *const c_int,
    *const f64,
    *const f64,
    *const c_int,
    *const f64,
    *const c_int,
    *const f64,
    *mut f64,
    *const c_int,
    usize,
    usize,
);

/// `dtrsm` as Fortran has it.
type Dtrsm = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    *const c_char,
    *const c_int,
    *const c_int,
    *const f64,
    *const f64,
    *const c_int,
    *mut f64,
    *const c_int,
    usize,
    usize,
    usize,
    usize,
);

extern "C" {
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// Variable of the environment; 0 leaves all products to the library.
const OFF: &str = "RAILSQUEAL_THIN_BLAS";
const MISSING: &str = "no library of this process has dgemm_ and dtrsm_ of BLAS";
const PRODUCT: &CStr = c"dgemm_";
const TRIANGLE: &CStr = c"dtrsm_";
/// Handles of `dlsym`, of dlfcn.h: the first one of the process, and the next one after who asks.
const DEFAULT: isize = 0;
const NEXT: isize = -1;

fn look_up(handle: isize, name: &CStr) -> *mut c_void {
    // SAFETY: a handle of dlfcn.h and a name that ends with a zero byte.
    unsafe { dlsym(handle as *mut c_void, name.as_ptr()) }
}

/// The library's functions.
fn library() -> Option<(Dgemm, Dtrsm)> {
    static LIBRARY: OnceLock<Option<(Dgemm, Dtrsm)>> = OnceLock::new();
    *LIBRARY.get_or_init(|| {
        let (product, triangle) = (look_up(NEXT, PRODUCT), look_up(NEXT, TRIANGLE));
        let both = !product.is_null() && !triangle.is_null();
        // SAFETY: what a library has by these names are BLAS's functions, of these types.
        both.then(|| unsafe {
            (std::mem::transmute::<*mut c_void, Dgemm>(product), std::mem::transmute::<*mut c_void, Dtrsm>(triangle))
        })
    })
}

/// The same for a call that has come already: whoever asked [`serves`] knows whether there are any.
fn passed_on() -> (Dgemm, Dtrsm) {
    library().unwrap_or_else(|| {
        eprintln!("railsqueal: error: {MISSING}");
        std::process::abort()
    })
}

/// The processor's vector instructions that the kernels are written in; none where they are not wanted.
fn vectors() -> Option<V3> {
    static VECTORS: OnceLock<Option<V3>> = OnceLock::new();
    *VECTORS.get_or_init(|| if std::env::var_os(OFF).is_some_and(|v| v == "0") { None } else { V3::try_new() })
}

pub(crate) fn serves() -> Result<bool, &'static str> {
    library().ok_or(MISSING)?;
    let first = [look_up(DEFAULT, PRODUCT), look_up(DEFAULT, TRIANGLE)];
    Ok(vectors().is_some() && first == [dgemm_ as Dgemm as *mut c_void, dtrsm_ as Dtrsm as *mut c_void])
}

thread_local! {
    /// The columns of a product, side by side.
    static ROWS: RefCell<Vec<[f64; COLUMNS]>> = const { RefCell::new(Vec::new()) };
}

/// C = αop(A)op(B) + βC, as BLAS has it: op(A) of `[m, k]`, op(B) of `[k, n]`.
///
/// # Safety
/// Pointers and dimensions as BLAS demands them.
#[no_mangle]
unsafe extern "C" fn dgemm_(
    a_word: *const c_char,
    b_word: *const c_char,
    m: *const c_int,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
    a_length: usize,
    b_length: usize,
) {
    // SAFETY: the caller's pointers are valid; words have a letter at least.
    let (word, plain) = unsafe { (letter(a_word), letter(b_word) == b'N') };
    // SAFETY: as above.
    let sizes = unsafe { [*m, *n, *k, *lda, *ldb, *ldc] }.map(|v| usize::try_from(v).unwrap_or(0));
    let [rows, columns, inner, a_stride, b_stride, c_stride] = sizes;
    let (a_rows, a_columns) = if word == b'N' { (rows, inner) } else { (inner, rows) };
    let thin = plain
        && matches!(word, b'N' | b'T' | b'C')
        && (2..=COLUMNS).contains(&columns)
        && rows >= kernel::LEAST
        && inner > 0
        && a_stride >= a_rows
        && b_stride >= inner
        && c_stride >= rows;
    if let (true, Some(simd)) = (thin, vectors()) {
        ROWS.with_borrow_mut(|space| {
            // SAFETY: matrices of these sizes and strides. B and C may be rows of the same columns, so C is taken up when B has been read.
            unsafe {
                let b = slice::from_raw_parts(b, b_stride * (columns - 1) + inner);
                kernel::side_by_side(b, b_stride, inner, *alpha, space);
            }
            // SAFETY: as above; C is written by nobody else meanwhile and does not overlap A.
            let (a, c) = unsafe {
                (
                    slice::from_raw_parts(a, a_stride * (a_columns - 1) + a_rows),
                    slice::from_raw_parts_mut(c, c_stride * (columns - 1) + rows),
                )
            };
            // SAFETY: a number of the caller's.
            kernel::scale(c, c_stride, rows, unsafe { *beta });
            let transposed = word != b'N';
            Product { simd, transposed, a, a_stride, rows, b: space, c, c_stride }.add();
        });
        return;
    }
    // SAFETY: the caller's arguments as they came.
    unsafe { passed_on().0(a_word, b_word, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc, a_length, b_length) }
}

/// B becomes αop(A)⁻¹B or αBop(A)⁻¹, as BLAS has it. The triangles of a symmetric factor are solved here.
///
/// # Safety
/// Pointers and dimensions as BLAS demands them.
#[no_mangle]
unsafe extern "C" fn dtrsm_(
    side: *const c_char,
    half: *const c_char,
    word: *const c_char,
    diagonal: *const c_char,
    m: *const c_int,
    n: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *mut f64,
    ldb: *const c_int,
    side_length: usize,
    half_length: usize,
    word_length: usize,
    diagonal_length: usize,
) {
    // SAFETY: the caller's pointers are valid; words have a letter at least.
    let (words, transposed) = unsafe { ([side, half, diagonal].map(|w| letter(w)), letter(word)) };
    // SAFETY: as above.
    let [order, columns, stride, b_stride] = unsafe { [*m, *n, *lda, *ldb] }.map(|v| usize::try_from(v).unwrap_or(0));
    let own = words == *b"LUU"
        && matches!(transposed, b'N' | b'T' | b'C')
        && columns > 1
        && order > 0
        && stride >= order
        && b_stride >= order
        // SAFETY: as above.
        && unsafe { *alpha } == 1.0;
    if let (true, Some(simd)) = (own, vectors()) {
        let part = Part { simd, transposed: transposed != b'N', a, stride, b, b_stride, columns };
        // SAFETY: matrices of these sizes and strides, written by nobody else meanwhile; A and B do not overlap.
        return unsafe { part.solve(order) };
    }
    // SAFETY: the caller's arguments as they came.
    unsafe {
        passed_on().1(
            side,
            half,
            word,
            diagonal,
            m,
            n,
            alpha,
            a,
            lda,
            b,
            ldb,
            side_length,
            half_length,
            word_length,
            diagonal_length,
        )
    }
}

/// A block on the diagonal of an upper triangle, and the rows of the right-hand sides that belong to it.
#[derive(Clone, Copy)]
struct Part {
    simd: V3,
    transposed: bool,
    a: *const f64,
    stride: usize,
    b: *mut f64,
    b_stride: usize,
    columns: usize,
}

impl Part {
    /// Halves until they are small; between the halves is a product.
    ///
    /// # Safety
    /// A is of this `order`, B of as many rows; they do not overlap.
    unsafe fn solve(self, order: usize) {
        if order <= LARGEST {
            // SAFETY: the caller's promise.
            return unsafe { self.small(order) };
        }
        let upper = (order / 2).next_multiple_of(kernel::GROUP);
        // SAFETY: blocks of A and B as promised.
        unsafe {
            let lower = Self { a: self.a.add(upper * (self.stride + 1)), b: self.b.add(upper), ..self };
            let beside = self.a.add(upper * self.stride);
            match self.transposed {
                true => {
                    self.solve(upper);
                    self.take(c"T", beside, [order - upper, upper], self.b, lower.b);
                    lower.solve(order - upper);
                }
                false => {
                    lower.solve(order - upper);
                    self.take(c"N", beside, [upper, order - upper], lower.b, self.b);
                    self.solve(upper);
                }
            }
        }
    }

    /// `to` −= op(A) `from`, op(A) of this size.
    ///
    /// # Safety
    /// Blocks of A and B.
    unsafe fn take(&self, word: &CStr, a: *const f64, size: [usize; 2], from: *const f64, to: *mut f64) {
        let [m, k] = size.map(|v| v as c_int);
        let [n, lda, ldb] = [self.columns, self.stride, self.b_stride].map(|v| v as c_int);
        let (plain, minus, one) = (c"N".as_ptr(), -1.0, 1.0);
        // SAFETY: the caller's promise; the sizes were integers of Fortran before.
        unsafe { dgemm_(word.as_ptr(), plain, &m, &n, &k, &minus, a, &lda, from, &ldb, &one, to, &ldb, 1, 1) }
    }

    /// # Safety
    /// As [`Self::solve`].
    unsafe fn small(self, order: usize) {
        // SAFETY: a block of A, which nobody writes.
        let a = unsafe { slice::from_raw_parts(self.a, self.stride * (order - 1) + order) };
        ROWS.with_borrow_mut(|space| {
            for first in (0..self.columns).step_by(COLUMNS) {
                let some = first..self.columns.min(first + COLUMNS);
                space.clear();
                space.resize(order, [0.0; COLUMNS]);
                for (j, column) in some.clone().enumerate() {
                    // SAFETY: a column of this block of B.
                    let column = unsafe { slice::from_raw_parts(self.b.add(column * self.b_stride), order) };
                    column.iter().zip(&mut *space).for_each(|(v, row)| row[j] = *v);
                }
                Triangle { simd: self.simd, transposed: self.transposed, a, stride: self.stride, b: space }.solve();
                for (j, column) in some.enumerate() {
                    // SAFETY: as above; nothing else refers to it.
                    let column = unsafe { slice::from_raw_parts_mut(self.b.add(column * self.b_stride), order) };
                    column.iter_mut().zip(&*space).for_each(|(v, row)| *v = row[j]);
                }
            }
        });
    }
}

/// A letter of BLAS, a capital.
///
/// # Safety
/// The word has a letter.
unsafe fn letter(word: *const c_char) -> u8 {
    // SAFETY: the caller's promise.
    unsafe { *word.cast::<u8>() }.to_ascii_uppercase()
}
