//! Finds MUMPS, generates the bindings, and says which libraries to link.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, process};

fn main() {
    for variable in ["MUMPS_DIR", "PETSC_DIR", "PETSC_ARCH", "LIBRARY_PATH"] {
        println!("cargo:rerun-if-env-changed={variable}");
    }
    println!("cargo:rerun-if-changed=wrapper.h");
    let (include, lib) = find();
    let header = include.join("dmumps_c.h");
    println!("cargo:rerun-if-changed={}", header.display());
    let text = fs::read_to_string(&header).unwrap_or_else(|e| fail(&format!("{}: {e}", header.display())));
    let version = text
        .lines()
        .find_map(|l| l.strip_prefix("#define MUMPS_VERSION \""))
        .and_then(|l| l.split('"').next())
        .unwrap_or_else(|| fail(&format!("{}: no MUMPS_VERSION in it", header.display())))
        .to_owned();
    generate(&include);
    let variant = link(lib.as_deref(), &version);
    println!("cargo:version={version}");
    println!("cargo:variant={variant}");
    println!("cargo:lib_dir={}", lib.map(|p| p.display().to_string()).unwrap_or_default());
    println!("cargo:rustc-env=MUMPS_SYS_VERSION={version}");
}

/// Include directory, and library directory unless the linker knows it by itself.
fn find() -> (PathBuf, Option<PathBuf>) {
    let set = |name: &str| env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let mut tried = Vec::new();
    if let Some(dir) = set("MUMPS_DIR") {
        if dir.join("include/dmumps_c.h").is_file() {
            return (dir.join("include"), Some(dir.join("lib")));
        }
        fail(&format!("MUMPS_DIR={}: there is no include/dmumps_c.h in it.", dir.display()));
    }
    if let Some(dir) = set("PETSC_DIR") {
        for base in set("PETSC_ARCH").map(|a| dir.join(a)).into_iter().chain([dir]) {
            if base.join("include/dmumps_c.h").is_file() {
                return (base.join("include"), Some(base.join("lib")));
            }
            tried.push(base.join("include"));
        }
    }
    for dir in ["/usr/include", "/usr/include/mumps", "/usr/local/include"].map(PathBuf::from) {
        if dir.join("dmumps_c.h").is_file() {
            return (dir, None);
        }
        tried.push(dir);
    }
    fail(&format!(
        "dmumps_c.h was not found in {tried:?}. Install MUMPS with its headers (Debian: libmumps-dev), or set \
         MUMPS_DIR \
         to the directory that holds include/dmumps_c.h and lib/."
    ))
}

/// Links MUMPS and returns the variant's suffix, `_ptscotch` or nothing.
fn link(lib: Option<&Path>, version: &str) -> &'static str {
    if let Some(dir) = lib {
        println!("cargo:rustc-link-search=native={}", dir.display());
        if !dir.join("libdmumps.so").is_file() {
            link_static(dir);
            return "";
        }
    } else {
        // Debian keeps the variant with SCOTCH beside the default one, which has only the PORD ordering. It has no
        // unversioned name to link by.
        let number = version.split('.').take(2).collect::<Vec<_>>().join(".");
        let name = |base: &str| format!("lib{base}_ptscotch-{number}.so");
        if known_to_linker(&name("dmumps")) {
            println!("cargo:rustc-link-lib=dylib:+verbatim={}", name("dmumps"));
            println!("cargo:rustc-link-lib=dylib:+verbatim={}", name("mumps_common"));
            return "_ptscotch";
        }
    }
    println!("cargo:rustc-link-lib=dmumps");
    println!("cargo:rustc-link-lib=mumps_common");
    ""
}

/// A static MUMPS (as `--download-mumps` makes it) needs what it was built on, which only PETSc's configuration knows.
fn link_static(dir: &Path) {
    println!("cargo:rustc-link-lib=static=dmumps");
    println!("cargo:rustc-link-lib=static=mumps_common");
    let pc = ["petsc.pc", "PETSc.pc"].map(|n| dir.join("pkgconfig").join(n));
    let text = pc.iter().find_map(|p| fs::read_to_string(p).ok()).unwrap_or_default();
    let private = text.lines().find_map(|l| l.strip_prefix("Libs.private:")).unwrap_or_default();
    for word in private.split_whitespace() {
        if let Some(path) = word.strip_prefix("-L") {
            println!("cargo:rustc-link-search=native={}", path.replace("${libdir}", &dir.display().to_string()));
        } else if let Some(name) = word.strip_prefix("-l") {
            if !["dmumps", "mumps_common"].contains(&name) {
                println!("cargo:rustc-link-lib={name}");
            }
        }
    }
}

/// True if the C compiler's linker finds the file by name.
fn known_to_linker(file: &str) -> bool {
    let compiler = env::var("CC").unwrap_or_else(|_| "cc".into());
    let found = Command::new(compiler).arg(format!("-print-file-name={file}")).output();
    found.map(|o| Path::new(String::from_utf8_lossy(&o.stdout).trim()).is_file()).unwrap_or(false)
}

fn generate(include: &Path) {
    let bindings = bindgen::Builder::default()
        .header("wrapper.h")
        .clang_arg(format!("-I{}", include.display()))
        .allowlist_function("dmumps_c")
        .allowlist_type("DMUMPS_STRUC_C")
        .derive_debug(false)
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .unwrap_or_else(|error| {
            fail(&format!(
                "bindgen failed on dmumps_c.h: {error}\nIt needs libclang and clang's own headers \
             (Debian: libclang1-14 libclang-common-14-dev)."
            ))
        });
    // MUMPS_INT is a macro, which bindgen resolves away; code built on these bindings needs its name.
    let wide = ["mumps_int_def.h", "mumps_c_types.h"]
        .iter()
        .filter_map(|n| fs::read_to_string(include.join(n)).ok())
        .any(|t| {
            t.lines().any(|l| {
                l.split_whitespace().eq(["#", "define", "MUMPS_INTSIZE64"])
                    || l.split_whitespace().eq(["#define", "MUMPS_INTSIZE64"])
            })
        });
    let text = format!(
        "{bindings}\n/// MUMPS_INT of this build.\npub type MUMPS_INT = {};\n",
        if wide { "i64" } else { "::std::os::raw::c_int" }
    );
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("bindings.rs");
    if let Err(error) = fs::write(&out, text) {
        fail(&format!("{}: {error}", out.display()));
    }
}

fn fail(message: &str) -> ! {
    eprintln!("\nmumps-sys: {message}\n");
    process::exit(1);
}
