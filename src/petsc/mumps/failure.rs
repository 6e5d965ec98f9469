//! Meaning of the error codes of MUMPS (users' guide, section 8), for real and complex factorisations alike.

use crate::memory::{reserve, Limit};
use crate::parallel::World;
use crate::{Error, Result};

/// INFOG(1) after a zero pivot.
pub(super) const SINGULAR: i64 = -10;

/// Operation of MUMPS, for its messages.
pub(in crate::petsc) struct MumpsCall<'a> {
    /// Such as "the factorisation of K".
    pub what: &'a str,
    /// Name of the matrix.
    pub matrix: &'a str,
    /// Bytes of an entry of the factors.
    pub entry: f64,
    /// Memory that the analysis found necessary on the rank that needs most, MB; 0 before it is known.
    pub megabytes: u64,
    /// Alternative where there is not enough memory.
    pub advice: &'a str,
}

/// INFOG(1) = `code` with INFOG(2) = `detail` as a result.
pub(in crate::petsc) fn failure(code: i64, detail: i64, f: &MumpsCall) -> Result<()> {
    if code >= 0 {
        return Ok(());
    }
    let MumpsCall { what, matrix, entry, megabytes, advice } = f;
    // Sizes beyond 32 bits come as negative millions.
    let entries = if detail < 0 { -(detail as f64) * 1e6 } else { detail as f64 };
    let refused = entries * entry / 1e6;
    let need = match megabytes {
        0 => "what it needs in all is not known yet".into(),
        n => format!("it needs about {n} MB on one rank in all"),
    };
    Err(match code {
        -13 => Error::Memory(format!(
            "out of memory in {what}: MUMPS was refused {refused:.0} MB; {need} (error {code}). Use {advice}."
        )),
        -5 | -7 | -19 | -75 | -76 | -80 => {
            Error::Memory(format!("out of memory in {what}: {need} (MUMPS error {code}, {detail}). Use {advice}."))
        }
        -8 | -9 | -14 | -15 | -17 | -20 => Error::Memory(format!(
            "{what}: the workspace of MUMPS is too small even far above its estimate: {need} (error {code}, \
             {detail}). Use {advice}."
        )),
        -90 => Error::Io(format!(
            "{what}: MUMPS cannot write its factors to the disk or read them back (error -90, {detail}); is \
             there space where solver.out_of_core says?"
        )),
        SINGULAR | -6 => Error::NotConverged(format!(
            "matrix {matrix} is singular (MUMPS error {code} after {detail} pivots): is the body held by a \
             fixed group, is \
             every node part of an element, and is a shift not an eigenvalue?"
        )),
        -40 => Error::NotConverged(format!("matrix {matrix} is not positive definite (MUMPS error -40)")),
        _ => Error::Defect(format!("MUMPS, {what}: error {code}, {detail}")),
    })
}

/// Collective: an error where the ranks of a node do not get the memory that the analysis found necessary,
/// `megabytes` on this rank. It is asked for and given back, before MUMPS takes it piece by piece and the linear
/// algebra beneath it is left without.
pub(in crate::petsc) fn room(world: &World, megabytes: u64, f: &MumpsCall) -> Result<()> {
    let need = 1e6 * megabytes as f64;
    let node = world.sum_on_node(need);
    let look = || {
        reserve(need)?;
        let there = Limit::of_system();
        match node <= there.bytes + Limit::swap() {
            true => Ok(()),
            false => Err(format!(
                "all ranks of this node need {:.0} MB, {} leaves {:.0} MB",
                node / 1e6,
                there.source,
                there.bytes / 1e6
            )),
        }
    };
    let MumpsCall { what, advice, megabytes, .. } = f;
    let short = |why| {
        Error::Memory(format!(
            "out of memory in {what}: it needs about {megabytes} MB on one rank in all; {why}. Use {advice}."
        ))
    };
    world.agree(look().map_err(short))
}

/// Collective: an error where the factors go to the disk and there is no space for them, `bytes` of this rank.
pub(in crate::petsc) fn space(world: &World, bytes: f64, f: &MumpsCall) -> Result<()> {
    let node = world.sum_on_node(bytes);
    let look = || {
        let Some(scratch) = world.scratch.get() else { return Ok(()) };
        let free = scratch.free()?;
        match node <= free {
            true => Ok(()),
            false => Err(Error::Io(format!(
                "solver.out_of_core: the factors of matrix {} need {:.1} GB of disk on this machine, there are \
                 {:.1} GB free at {}; name another folder",
                f.matrix,
                node / 1e9,
                free / 1e9,
                scratch.path().display()
            ))),
        }
    };
    world.agree(look())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_sorted_by_what_the_user_can_do() {
        let at = |code, detail, megabytes| {
            let f = MumpsCall { what: "the factorisation of K", matrix: "K", entry: 16.0, megabytes, advice: "less" };
            failure(code, detail, &f)
        };
        assert!(at(0, 0, 0).is_ok() && at(1, 5, 0).is_ok(), "warnings are no failures");
        let refused = at(-13, -250, 900).unwrap_err();
        assert_eq!(refused.exit_code(), 7);
        for part in ["the factorisation of K", "refused 4000 MB", "about 900 MB", "Use less."] {
            assert!(refused.message().contains(part), "{part}: {refused}");
        }
        let early = at(-7, 12, 0).unwrap_err();
        assert!(early.exit_code() == 7 && early.message().contains("not known yet"), "{early}");
        for (code, exit) in [(-9, 7), (-20, 7), (SINGULAR, 4), (-40, 4), (-90, 6), (-3, 1)] {
            assert_eq!(at(code, 1, 1).unwrap_err().exit_code(), exit, "{code}");
        }
    }
}
