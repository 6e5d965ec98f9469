//! The Fortran interface, and what lies behind it.

use std::cell::RefCell;
use std::ffi::{c_char, c_int, c_void, CStr};
use std::slice;
use std::sync::OnceLock;

use pulp::x86::V3;

use crate::kernel::{self, Product, COLUMNS};

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

extern "C" {
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// Variable of the environment; 0 leaves all products to the library.
const OFF: &str = "RAILSQUEAL_THIN_BLAS";
const MISSING: &str = "no library of this process has dgemm_ of BLAS";
const NAME: &CStr = c"dgemm_";
/// Handles of `dlsym`, of dlfcn.h: the first one of the process, and the next one after who asks.
const DEFAULT: isize = 0;
const NEXT: isize = -1;

fn look_up(handle: isize) -> *mut c_void {
    // SAFETY: a handle of dlfcn.h and a name that ends with a zero byte.
    unsafe { dlsym(handle as *mut c_void, NAME.as_ptr()) }
}

/// The library's function.
fn library() -> Option<Dgemm> {
    static LIBRARY: OnceLock<Option<Dgemm>> = OnceLock::new();
    *LIBRARY.get_or_init(|| {
        let found = look_up(NEXT);
        // SAFETY: what a library has by this name is BLAS's function, of this type.
        (!found.is_null()).then(|| unsafe { std::mem::transmute::<*mut c_void, Dgemm>(found) })
    })
}

/// The processor's vector instructions that the kernels are written in; none where they are not wanted.
fn vectors() -> Option<V3> {
    static VECTORS: OnceLock<Option<V3>> = OnceLock::new();
    *VECTORS.get_or_init(|| if std::env::var_os(OFF).is_some_and(|v| v == "0") { None } else { V3::try_new() })
}

pub(crate) fn serves() -> Result<bool, &'static str> {
    library().ok_or(MISSING)?;
    Ok(vectors().is_some() && look_up(DEFAULT) == dgemm_ as Dgemm as *mut c_void)
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
        // SAFETY: matrices of these sizes and strides; C is written by nobody else meanwhile and overlaps neither A nor B.
        let (a, b, c, alpha, beta) = unsafe {
            (
                slice::from_raw_parts(a, a_stride * (a_columns - 1) + a_rows),
                slice::from_raw_parts(b, b_stride * (columns - 1) + inner),
                slice::from_raw_parts_mut(c, c_stride * (columns - 1) + rows),
                *alpha,
                *beta,
            )
        };
        ROWS.with_borrow_mut(|space| {
            kernel::side_by_side(b, b_stride, inner, alpha, space);
            kernel::scale(c, c_stride, rows, beta);
            let transposed = word != b'N';
            Product { simd, transposed, a, a_stride, rows, b: space, c, c_stride }.add();
        });
        return;
    }
    let Some(next) = library() else {
        // Whoever asked [`serves`] knows.
        eprintln!("railsqueal: error: {MISSING}");
        std::process::abort();
    };
    // SAFETY: the caller's arguments as they came.
    unsafe { next(a_word, b_word, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc, a_length, b_length) }
}

/// A letter of BLAS, a capital.
///
/// # Safety
/// The word has a letter.
unsafe fn letter(word: *const c_char) -> u8 {
    // SAFETY: the caller's promise.
    unsafe { *word.cast::<u8>() }.to_ascii_uppercase()
}
