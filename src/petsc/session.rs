//! PETSc and SLEPc from initialisation to the end, their options, and their errors as [`Error`].

use super::handle::Handle;
use crate::memory::reserve;
use crate::parallel::World;
use crate::{Error, Result};
use petsc_sys as sys;
use std::cell::RefCell;
use std::ffi::{c_char, c_int, c_void, CStr, CString};
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

/// One session at a time: PETSc's state is the process's.
static RUNNING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// PETSc's report of the failure that is being unwound: first the message, then the functions it went through.
    static REPORT: RefCell<String> = const { RefCell::new(String::new()) };
}

/// PETSc and SLEPc, initialised. Objects of theirs borrow it and so end before it; it ends before MPI does.
pub struct Petsc<'w> {
    world: &'w World,
    /// Options set by [`Petsc::default_option`].
    defaults: RefCell<Vec<String>>,
}

/// Versions of the libraries in this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// PETSc, as loaded.
    pub petsc: String,
    /// SLEPc, as loaded.
    pub slepc: String,
    /// MUMPS, of the headers.
    pub mumps: String,
    /// Scalar type of PETSc.
    pub scalar: String,
    /// Width of PETSc's integers, bit.
    pub int_width: u32,
}

impl<'w> Petsc<'w> {
    /// Collective: initialises PETSc and SLEPc. Options in order of rising precedence: `options` (name with or without
    /// its leading minus, value; empty for a flag), the environment variable `PETSC_OPTIONS`, and `arguments` as on a
    /// command line. The `.petscrc` files are not read: a job does not depend on where it is started.
    pub fn start(world: &'w World, options: &[(String, String)], arguments: &[String]) -> Result<Self> {
        if RUNNING.swap(true, Ordering::SeqCst) {
            return Err(Error::Defect("PETSc was started twice".into()));
        }
        match Self::initialise(options, arguments) {
            Ok(()) => {
                let session = Self { world, defaults: RefCell::default() };
                session.touch_blas()?;
                Ok(session)
            }
            Err(error) => {
                RUNNING.store(false, Ordering::SeqCst);
                Err(error)
            }
        }
    }

    fn initialise(options: &[(String, String)], arguments: &[String]) -> Result<()> {
        let text = |s: &str| {
            CString::new(s).map_err(|_| Error::Job(format!("PETSc option {s:?} holds a zero byte; remove it")))
        };
        let mut pairs = Vec::new();
        for (name, value) in options {
            let bare = name.trim_start_matches('-');
            if bare.is_empty() || bare.contains(char::is_whitespace) || bare.starts_with(|c: char| c.is_ascii_digit()) {
                return Err(Error::Job(format!(
                    "petsc_options: {name:?} is not an option's name, such as \"mg_levels_ksp_type\""
                )));
            }
            pairs.push((text(&format!("-{bare}"))?, text(value)?));
        }
        if let Some(first) = arguments.first().filter(|a| !a.starts_with('-')) {
            return Err(Error::Job(format!(
                "PETSc options after --: expected an option such as -log_view first, found {first:?}"
            )));
        }
        // Signals are the program's own; PETSc's list of unused options is replaced by [`Petsc::unused_options`].
        let fixed = ["railsqueal", "-no_signal_handler", "-skip_petscrc", "-options_left", "no"];
        let words = fixed.iter().copied().chain(arguments.iter().map(String::as_str));
        let words = words.map(text).collect::<Result<Vec<_>>>()?;
        for (name, value) in &pairs {
            let value = if value.is_empty() { ptr::null() } else { value.as_ptr() };
            // SAFETY: both strings end in zero and are copied; allowed before initialisation.
            check(unsafe { sys::PetscOptionsSetValue(ptr::null_mut(), name.as_ptr(), value) }, "setting an option")?;
        }
        // PETSc keeps the pointers to the arguments until it is finalised and may look at them then (`-log_view` prints
        // them): they live as long as the process.
        let mut argv: Vec<*mut c_char> = words.into_iter().map(CString::into_raw).collect();
        let mut argc = argv.len() as c_int;
        argv.push(ptr::null_mut());
        let argv: &'static mut [*mut c_char] = Box::leak(argv.into_boxed_slice());
        let holder: &'static mut *mut *mut c_char = Box::leak(Box::new(argv.as_mut_ptr()));
        check(
            // SAFETY: argc and argv describe a null-terminated argument vector that is never freed; MPI is initialised,
            // as the caller holds a World.
            unsafe { slepc_sys::SlepcInitialize(&mut argc, holder, ptr::null(), ptr::null()) },
            "initialising SLEPc",
        )?;
        // SAFETY: the handler has the signature asked for, needs no context, and does not unwind.
        check(unsafe { sys::PetscPushErrorHandler(Some(collect), ptr::null_mut()) }, "setting PETSc's error handler")
    }

    /// Collective: has OpenBLAS take its buffers now, if there is room for them. It takes them at the first product
    /// otherwise, and where MUMPS has left no memory by then it asks for them again and again, for ever.
    fn touch_blas(&self) -> Result<()> {
        /// Twice an upper bound of the memory that OpenBLAS takes for a thread, byte.
        const BUFFERS: f64 = 256e6;
        /// Products of smaller matrices get by with the stack.
        const N: usize = 128;
        let short = |why| {
            Error::Memory(format!(
                "out of memory before anything is computed: {why}; raise the limit, or use fewer ranks on a machine"
            ))
        };
        self.world.agree(reserve(BUFFERS).map_err(short))?;
        let n = N as sys::PetscInt;
        let doing = "a first product";
        // SAFETY: a communicator that always exists, valid outputs; PETSc allocates the values.
        let matrix = Handle::create(self, doing, |m| unsafe {
            sys::MatCreateDense(mpi::ffi::RSMPI_COMM_SELF, n, n, n, n, ptr::null_mut(), m)
        })?;
        // SAFETY: as above.
        let make = || Handle::create(self, doing, |v| unsafe { sys::VecCreateMPI(mpi::ffi::RSMPI_COMM_SELF, n, n, v) });
        let (x, y) = (make()?, make()?);
        // SAFETY: live objects that fit each other.
        unsafe {
            check(sys::MatAssemblyBegin(matrix.raw(), sys::MatAssemblyType_MAT_FINAL_ASSEMBLY), doing)?;
            check(sys::MatAssemblyEnd(matrix.raw(), sys::MatAssemblyType_MAT_FINAL_ASSEMBLY), doing)?;
            check(sys::MatMult(matrix.raw(), x.raw(), y.raw()), doing)
        }
    }

    /// The ranks.
    pub fn world(&self) -> &'w World {
        self.world
    }

    /// Sets an option (name without minus) that the user did not give.
    pub(crate) fn default_option(&self, name: &str, value: &str) -> Result<()> {
        let text = |s: String| CString::new(s).map_err(|_| Error::Defect(format!("zero byte in option {name}")));
        let option = format!("-{name}");
        let (name, value) = (text(option.clone())?, text(value.to_owned())?);
        let mut given = sys::PETSC_FALSE;
        // SAFETY: strings that end in zero and are copied; a valid output.
        unsafe {
            check(
                sys::PetscOptionsHasName(ptr::null_mut(), ptr::null(), name.as_ptr(), &mut given),
                "reading an option",
            )?;
            if given == sys::PETSC_TRUE {
                return Ok(());
            }
            check(sys::PetscOptionsSetValue(ptr::null_mut(), name.as_ptr(), value.as_ptr()), "setting an option")?;
        }
        self.defaults.borrow_mut().push(option);
        Ok(())
    }

    /// Options that were given and that no object has asked for so far, with their values.
    pub fn unused_options(&self) -> Result<Vec<String>> {
        let (mut n, mut names, mut values) = (0, ptr::null_mut(), ptr::null_mut());
        // SAFETY: the three outputs are valid; names and values hold n strings (a value may be null) until restored.
        unsafe {
            check(
                sys::PetscOptionsLeftGet(ptr::null_mut(), &mut n, &mut names, &mut values),
                "listing unused options",
            )?;
            let text = |p: *mut c_char| (!p.is_null()).then(|| CStr::from_ptr(p).to_string_lossy().into_owned());
            let list = (0..n as usize).filter_map(|i| {
                let name = text(*names.add(i))?;
                Some(match text(*values.add(i)).filter(|v| !v.is_empty()) {
                    Some(value) => format!("-{name} {value}"),
                    None => format!("-{name}"),
                })
            });
            // Those set here are not the user's.
            let own = ["-no_signal_handler", "-skip_petscrc", "-options_left"];
            let defaults = self.defaults.borrow();
            let ours = |name: &str| own.contains(&name) || defaults.iter().any(|d| d == name);
            let list = list.filter(|o| !o.split(' ').next().is_some_and(ours)).collect();
            check(
                sys::PetscOptionsLeftRestore(ptr::null_mut(), &mut n, &mut names, &mut values),
                "listing unused options",
            )?;
            Ok(list)
        }
    }

    /// Versions of the libraries in this process. Needs no session.
    pub fn versions() -> Versions {
        let mut v = [0; 4];
        let number = |v: [sys::PetscInt; 4]| format!("{}.{}.{}", v[0], v[1], v[2]);
        let [a, b, c, d] = &mut v;
        // SAFETY: four valid outputs; allowed before initialisation.
        unsafe { sys::PetscGetVersionNumber(a, b, c, d) };
        let petsc = number(v);
        let [a, b, c, d] = &mut v;
        // SAFETY: as above.
        unsafe { slepc_sys::SlepcGetVersionNumber(a, b, c, d) };
        Versions {
            petsc,
            slepc: number(v),
            mumps: mumps_sys::VERSION.into(),
            scalar: env!("RAILSQUEAL_PETSC_SCALAR").into(),
            int_width: sys::PetscInt::BITS,
        }
    }
}

impl Drop for Petsc<'_> {
    fn drop(&mut self) {
        // SAFETY: initialised in `start`, finalised once, while MPI still runs. A failure leaves nothing to be done.
        unsafe {
            let mut over = 0;
            mpi::ffi::MPI_Finalized(&mut over);
            if over == 0 {
                slepc_sys::SlepcFinalize();
            }
        }
        RUNNING.store(false, Ordering::SeqCst);
    }
}

/// PETSc calls this on the way out of every function that failed; it replaces PETSc's own, by which every rank prints.
unsafe extern "C" fn collect(
    _comm: sys::MPI_Comm,
    line: c_int,
    function: *const c_char,
    _file: *const c_char,
    code: sys::PetscErrorCode,
    kind: sys::PetscErrorType,
    message: *const c_char,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    let text = |p: *const c_char| {
        if p.is_null() {
            return String::new();
        }
        // SAFETY: PETSc passes strings that end in zero or null, which was excluded.
        unsafe { CStr::from_ptr(p) }.to_string_lossy().trim().to_owned()
    };
    // A failure to record (the thread is ending) loses the text, not the code.
    let _ = REPORT.try_with(|report| {
        let Ok(mut report) = report.try_borrow_mut() else { return };
        if kind == sys::PetscErrorType_PETSC_ERROR_INITIAL {
            report.clear();
            *report += &format!("{} [{}:{line}", text(message), text(function));
        } else if report.len() < 2000 {
            *report += &format!(" < {}", text(function));
        }
    });
    code
}

/// Turns a return code into a result. `doing` says what was being done.
pub(crate) fn check(code: sys::PetscErrorCode, doing: &str) -> Result<()> {
    if code == 0 {
        return Ok(());
    }
    let report = REPORT.try_with(|r| r.try_borrow_mut().map(|mut r| std::mem::take(&mut *r)).unwrap_or_default());
    let mut report = report.unwrap_or_default();
    if report.contains(" [") {
        report.push(']');
    }
    let mut general = ptr::null();
    // SAFETY: the first output is valid, the second may be null; the text is PETSc's own constant.
    let general = unsafe {
        sys::PetscErrorMessage(code, &mut general, ptr::null_mut());
        if general.is_null() {
            String::new()
        } else {
            CStr::from_ptr(general).to_string_lossy().trim().to_owned()
        }
    };
    // PETSc 3.18 returns the line of the caller in place of PETSC_ERR_MEM where its allocation fails.
    if ["[PetscMalloc", "[PetscTrMalloc", "[PetscRealloc", "[PetscTrRealloc"].iter().any(|f| report.contains(f)) {
        return Err(Error::Memory(format!(
            "out of memory in PETSc, {doing}. {report} Use more ranks on more machines or a coarser mesh."
        )));
    }
    let message = format!("PETSc, {doing}: error {code}, {general}. {report}");
    // Their type is not the same in all versions.
    let one_of = |codes: &[i64]| codes.contains(&i64::from(code));
    Err(match () {
        _ if one_of(&[sys::PETSC_ERR_MEM.into()]) => Error::Memory(message),
        _ if one_of(&[
            sys::PETSC_ERR_ARG_UNKNOWN_TYPE.into(),
            sys::PETSC_ERR_USER_INPUT.into(),
            sys::PETSC_ERR_OPT_OVERWRITE.into(),
        ]) =>
        {
            Error::Job(format!("{message} Check the PETSc options."))
        }
        _ if one_of(&[
            sys::PETSC_ERR_CONV_FAILED.into(),
            sys::PETSC_ERR_NOT_CONVERGED.into(),
            sys::PETSC_ERR_MAT_LU_ZRPVT.into(),
            sys::PETSC_ERR_MAT_CH_ZRPVT.into(),
            sys::PETSC_ERR_FP.into(),
        ]) =>
        {
            Error::NotConverged(message)
        }
        _ if one_of(&[
            sys::PETSC_ERR_FILE_OPEN.into(),
            sys::PETSC_ERR_FILE_READ.into(),
            sys::PETSC_ERR_FILE_WRITE.into(),
            sys::PETSC_ERR_FILE_UNEXPECTED.into(),
        ]) =>
        {
            Error::Io(message)
        }
        _ => Error::Defect(message),
    })
}
