//! `dgemm` of BLAS for products with two to eight columns, and `dtrsm` for upper triangles with a unit diagonal on the left, in front of the BLAS that the process has.
//!
//! A sparse direct solver reads its factor twice for each block of right-hand sides. With few columns that is a matter of memory bandwidth: each number read
//! takes part in as many multiplications as there are columns. BLAS libraries are made for square matrices. OpenBLAS copies the matrix into an order that its
//! kernels like, which costs as much as the product itself here. The kernels below read the matrix where it is, once, in the order in which it lies, and
//! ask for what comes next ahead of time.
//!
//! A factorisation LDLᵀ spends more than a quarter of its time in triangular solves, for which OpenBLAS's kernels of AVX-512 are at a fifth of what its products reach. Here a triangle is halved until
//! it fits the first-level cache, so that nearly all is products again.
//!
//! The program's `dgemm_` and `dtrsm_` take the place of the library's for all shared libraries of the process: a dynamic linker looks into the program first. Everything
//! else goes on to the library (`RTLD_NEXT`). On other processors and systems than x86-64 with AVX2 under Linux nothing is in between, and with
//! `RAILSQUEAL_THIN_BLAS=0` in the environment neither.

#![warn(missing_docs, clippy::undocumented_unsafe_blocks)]

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod front;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod kernel;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod triangle;

/// Whether `dgemm_` and `dtrsm_` of this process are those of this crate, and what they are made for its own. To be asked once before the first product: that is what links them.
///
/// # Errors
/// Nothing stands behind it: the process has no BLAS.
pub fn serves() -> Result<bool, &'static str> {
    #[cfg(all(target_os = "linux", target_arch = "x86_64"))]
    {
        front::serves()
    }
    #[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
    {
        Ok(false)
    }
}
