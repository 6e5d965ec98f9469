//! Arguments.

use clap::{Args, Parser, Subcommand, ValueEnum};
use railsqueal::{Error, Result};
use std::path::{Path, PathBuf};

/// Exit codes, shown by `--help`.
const AFTER: &str = "\
Run it under an MPI launcher for more than one rank: mpirun -n 4 railsqueal run job.json

Pages: docs/README.md; what each line of a summary means: docs/reference/summary.md

Exit codes:
  0  done
  1  a defect of the program
  2  wrong usage or job file
  3  a mesh or another input file is missing or wrong
  4  a solver did not converge
  5  stopped on request or by the time limit; what was computed is kept
  6  reading or writing failed, or a rank was lost
  7  not enough memory";

/// Rolling contact with friction between finite-element bodies.
#[derive(Debug, Parser)]
#[command(name = "railsqueal", disable_version_flag = true, after_help = AFTER, arg_required_else_help = false)]
pub struct Cli {
    /// Print the versions of railsqueal and of the libraries it uses
    #[arg(short = 'V', long)]
    pub version: bool,
    /// Subcommand
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// Subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the analyses of a job and write the results
    Run {
        /// Job file (JSON); with --resume it may be left out: the run has its job
        #[arg(value_name = "JOB", required_unless_present = "resume")]
        job: Option<PathBuf>,
        #[command(flatten)]
        changes: JobChanges,
        /// Result file [default: beside the job file, with the ending .h5]
        #[arg(short, long, value_name = "FILE.h5")]
        output: Option<PathBuf>,
        /// Replace an existing result file
        #[arg(short, long)]
        force: bool,
        /// Take modes and compliance from the result file of an earlier run with the same bodies
        #[arg(long, value_name = "FILE.h5")]
        reuse: Option<PathBuf>,
        /// Continue a transient, or branches of limit cycles, that were stopped, with this result file
        #[arg(long, value_name = "FILE.h5", conflicts_with_all = ["output", "force"])]
        resume: Option<PathBuf>,
        /// Wall time, s, within which a transient or branches of limit cycles stop by themselves, their state saved
        #[arg(long, value_name = "SECONDS")]
        wall_time: Option<f64>,
        /// PETSc options, after `--`
        #[arg(last = true, value_name = "PETSC OPTIONS")]
        petsc: Vec<String>,
    },
    /// Validate a job and say what it would compute, how large it is and how much memory it needs
    Check {
        /// Job file (JSON)
        #[arg(value_name = "JOB")]
        job: PathBuf,
        #[command(flatten)]
        changes: JobChanges,
        /// Write the surfaces of the meshes with their groups, supports and contact nodes, for ParaView and `plot`
        #[arg(long, value_name = "FILE.vtkhdf")]
        mesh: Option<PathBuf>,
    },
    /// Print shift, yaw, load and creepages of all wheels of the vehicle in the curve of a job
    Curving {
        /// Job file (JSON)
        #[arg(value_name = "JOB")]
        job: PathBuf,
        #[command(flatten)]
        changes: JobChanges,
        /// Beside the creep law, the forces of the discretised contact at every place
        #[arg(long)]
        contact: bool,
    },
    /// Write a job to begin with: NAME.json, and the meshes it needs
    Init {
        /// Kind of job
        #[arg(value_name = "NAME")]
        example: Example,
        /// Job file [default: NAME.json in this folder]
        #[arg(short, long, value_name = "FILE.json")]
        output: Option<PathBuf>,
    },
    /// Print the verdict and the summary of a result
    Summary {
        /// Result file
        #[arg(value_name = "FILE.h5")]
        file: PathBuf,
    },
    /// Draw pictures of a result, of a stopped run as far as it came
    Plot {
        /// Result file
        #[arg(value_name = "FILE.h5")]
        file: PathBuf,
        /// Folder of the pictures [default: beside the file]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Modes drawn for each body [default: 12]
        #[arg(long, value_name = "N")]
        modes: Option<usize>,
        /// png, pdf, svg, or several: png,pdf [default: png]
        #[arg(long, value_name = "LIST")]
        format: Option<String>,
        #[command(flatten)]
        measured: MeasuredOptions,
    },
    /// Write one HTML file with figures, tables, pictures, warnings and provenance of a result, and tables as CSV
    /// beside it
    Report {
        /// Result file
        #[arg(value_name = "FILE.h5")]
        file: PathBuf,
        /// Folder of the report [default: beside the file]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        measured: MeasuredOptions,
    },
    /// Fit natural frequencies and damping of modes to measured frequency responses, for `bodies.*.modes.measured`; or
    /// the pads of a rail to measured track decay rates
    Fit {
        /// Universal file (.uff, .unv) with frequency responses (dataset 58) or modes (dataset 55); with --decay a job
        /// file (JSON) with analyses.track_decay
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Frequencies within which modes are fitted [default: about each peak], or bands of decay rates [default:
        /// all], Hz; repeatable
        #[arg(long, value_name = "FROM,TO")]
        band: Vec<String>,
        /// Modes in each band [default: as many as the responses tell]
        #[arg(long, value_name = "N")]
        modes: Option<usize>,
        /// Numbers of the responses that are fitted together, as in 3,4 [default: all]
        #[arg(long, value_name = "LIST")]
        datasets: Option<String>,
        /// Write shapes of modes as well: axes of the universal file along x, y, z of the body, as in Y,-X,Z
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        axes: Option<String>,
        /// Origin of the body in the axes of the universal file, m [default: 0,0,0]
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "axes")]
        origin: Option<String>,
        /// Folder of JSON and picture [default: beside the file]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// png, pdf, svg, or several: png,pdf [default: png]
        #[arg(long, value_name = "LIST")]
        format: Option<String>,
        #[command(flatten)]
        track: TrackFitOptions,
    },
    /// Say what differs between two results; exit code 0 if they agree, 1 if not, 2 if they cannot be compared
    Compare {
        /// Result file
        #[arg(value_name = "A.h5")]
        one: PathBuf,
        /// Another one
        #[arg(value_name = "B.h5")]
        other: PathBuf,
        /// Relative difference that counts as none [default: 1e-6]
        #[arg(long, value_name = "T")]
        tolerance: Option<f64>,
    },
    /// Write the sound of a transient: the motion of a point, or the pressure of a body 7.5 m beside the track
    Sound {
        /// Result file with analyses.transient
        #[arg(value_name = "FILE.h5")]
        file: PathBuf,
        /// Name of the point, or lower or upper for a body with sound power [default: the first point, else the louder
        /// body]
        #[arg(long, value_name = "NAME")]
        point: Option<String>,
        /// Sound file [default: beside the result, with the ending .wav]
        #[arg(long, value_name = "FILE.wav")]
        out: Option<PathBuf>,
    },
    /// Write the fields of a result or a sequence for programs that do not read VTKHDF, or branches of limit cycles
    Export {
        /// Result file with fields, or one of its sequences (.vtkhdf)
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Format of the files [default: vtu]
        #[arg(long)]
        format: Option<ExportFormat>,
        /// Folder of the files [default: beside FILE]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Make the section of a wheel or a rail from a drawing (DXF) or a table of coordinates (CSV): a mesh for the job
    Section(SectionOptions),
    /// Print the JSON Schema of the job file
    Schema,
    /// Print what completes the command line in a shell
    #[command(hide = true)]
    Completion {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page
    #[command(hide = true)]
    Man,
    /// Read a result file and say nothing: whether that can be done without harm
    #[command(hide = true)]
    Probe {
        /// The files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// List of the differing values only
        #[arg(long)]
        head: bool,
    },
}

impl Command {
    /// Returns whether one process does it, however many were started.
    pub fn is_of_one(&self) -> bool {
        matches!(self, Self::Init { .. }) || self.is_of_results()
    }

    /// True for commands on result files, drawings and hammer tests, which the Python package performs.
    pub fn is_of_results(&self) -> bool {
        matches!(
            self,
            Self::Summary { .. }
                | Self::Plot { .. }
                | Self::Report { .. }
                | Self::Fit { track: TrackFitOptions { decay: None, .. }, .. }
                | Self::Compare { .. }
                | Self::Sound { .. }
                | Self::Export { .. }
                | Self::Section(_)
        )
    }
}

/// Measured receptances beside those of a result. The Python package reads them.
#[derive(Debug, Args)]
pub struct MeasuredOptions {
    /// Universal file with measured receptances, drawn beside the computed ones
    #[arg(long, value_name = "FILE.uff")]
    measured: Option<PathBuf>,
    /// Node of the file at the contact point of a body: upper=12, or upper=12,13 for a response at 12 and a force at
    /// 13; repeatable
    #[arg(long, value_name = "BODY=NODE", requires = "measured")]
    point: Vec<String>,
    /// Axes of the file along x, y and z of the job, as in Y,-X,Z
    #[arg(long, value_name = "X,Y,Z", requires = "measured", allow_hyphen_values = true)]
    axes: Option<String>,
    /// Measured track decay rates: columns frequency (Hz), vertical, lateral (dB/m)
    #[arg(long, value_name = "FILE.csv")]
    decay: Option<PathBuf>,
}

/// Options of `fit` for the track of a job.
#[derive(Debug, Args)]
pub struct TrackFitOptions {
    /// Measured track decay rates, to which the track of a job is fitted: columns frequency (Hz), vertical, lateral
    /// (dB/m)
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["modes", "datasets", "out", "format"])]
    pub decay: Option<PathBuf>,
    /// Key below bodies.*.track that is fitted, such as pad.vertical or sleeper.ballast.loss_factor [default: stiffness
    /// and loss factor of the pads]; repeatable
    #[arg(long, value_name = "KEY", requires = "decay")]
    pub key: Vec<String>,
    /// Override a key of the job, such as a value to begin with: dotted path and JSON value (or text); repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true, requires = "decay")]
    pub sets: Vec<String>,
}

/// Options of `section`. The Python package reads them; here they are checked, completed and documented.
#[derive(Debug, Args)]
pub struct SectionOptions {
    /// DXF drawing, or table of coordinates (CSV)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Kind of body that has the section
    #[arg(long)]
    kind: SectionKind,
    /// Unit of the drawing [default: the one that the file names]
    #[arg(long)]
    unit: Option<DrawingUnit>,
    /// Mesh [default: beside FILE]
    #[arg(short, long, value_name = "FILE.msh")]
    output: Option<PathBuf>,
    /// Replace an existing mesh
    #[arg(short, long)]
    force: bool,
    /// Picture of outline, groups and mesh (.png, .pdf or .svg)
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// Edge length of the mesh, m [default: 0.006]
    #[arg(long, value_name = "M")]
    size: Option<f64>,
    /// Edge length on the running line, m [default: the size, on rails at most 0.003]
    #[arg(long, value_name = "M")]
    fine: Option<f64>,
    /// Axis of the drawing along the axle or across the track [default: x]
    #[arg(long)]
    axis: Option<DrawingAxis>,
    /// Mirror x: the flange, or the middle of the track, is to be at +x
    #[arg(long)]
    mirror: bool,
    /// Point of the drawing that becomes (0, 0), in its unit and axes
    #[arg(long, num_args = 2, value_names = ["X", "Y"], allow_negative_numbers = true)]
    origin: Option<Vec<f64>>,
    /// Put the edges of a layer into a group, as in running=TREAD; repeatable
    #[arg(long, value_name = "NAME=LAYER")]
    group: Vec<String>,
    /// Put the curve at this point of the drawing into a group, as in running=-20,460; repeatable
    #[arg(long, value_name = "NAME=X,Y")]
    pick: Vec<String>,
    /// Leave out a layer; repeatable
    #[arg(long, value_name = "LAYER")]
    ignore: Vec<String>,
    /// Distance within which ends of curves are joined, m [default: 1e-5]
    #[arg(long, value_name = "M")]
    tolerance: Option<f64>,
    /// Density for the masses that are printed, kg/m³ [default: 7860]
    #[arg(long, value_name = "RHO")]
    density: Option<f64>,
}

/// Formats of `export`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ExportFormat {
    /// A file for each step, and a .pvd that lists them
    Vtu,
    /// One file and its .h5; for meshes of one kind of cell
    Xdmf,
    /// A table of the branches of limit cycles
    Csv,
}

/// Kinds of bodies with a section.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum SectionKind {
    Wheel,
    /// One half of it, up to the middle of its axle
    Wheelset,
    Rail,
}

/// Units of drawings.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum DrawingUnit {
    Mm,
    Cm,
    M,
    In,
}

/// Axes of drawings.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum DrawingAxis {
    X,
    Y,
}

/// Jobs to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Example {
    /// Two crowned cylinders: modes and steady rolling
    TwoCylinders,
    /// Meshes from Gmsh files
    OwnMesh,
    /// Stability over friction and creepage
    Sweep,
    /// An unstable mode in time, until its limit cycle, with its sound
    Squeal,
    /// A wheel on a rail from built-in sections and profiles: modes, steady rolling and stability
    WheelOnRail,
    /// All wheels of a bogie in a curve: angle of attack, creepages, and which of them squeal
    Bogie,
    /// A wheel of your own drawing on a rail; with the drawing (DXF) and the section that was made of it
    DrawnWheel,
    /// A wheel on a rail of your own drawing; with the drawing (CSV) and the section that was made of it
    DrawnRail,
    /// A wheelset of your own drawing with both wheels on their rails; with the drawing (CSV) and the section that was
    /// made of it
    DrawnWheelset,
    /// A wheel on a dry rail, on a wet one, and on one with a friction modifier
    FrictionModifier,
    /// A twin-disc rig, from small to large angles of attack
    TwinDisc,
    /// The contact of a wheel and a rail by their profiles
    WheelOnRailContact,
}

/// The job file of an example when none is named: in this folder, by the example's name.
pub fn default_job(example: Example) -> PathBuf {
    let name = example.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
    PathBuf::from(name).with_extension("json")
}

/// The script that completes the command line in a shell.
pub fn completion(shell: clap_complete::Shell) -> String {
    use clap::CommandFactory;
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "railsqueal", &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// The manual page, with a part for each subcommand that is shown; for troff.
pub fn manual() -> String {
    use clap::CommandFactory;
    let mut text = Vec::new();
    // Writing into memory does not fail.
    let _ = clap_mangen::Man::new(Cli::command()).render(&mut text);
    for command in Cli::command().get_subcommands().filter(|c| !c.is_hide_set()) {
        let page = clap_mangen::Man::new(command.clone().disable_help_flag(true));
        text.extend(format!(".SH \"railsqueal {}\"\n", command.get_name()).bytes());
        let _ = page.render_description_section(&mut text).and_then(|()| page.render_options_section(&mut text));
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Changes that the command line makes in the job.
#[derive(Debug, Args)]
pub struct JobChanges {
    /// Override a key of the job: dotted path and JSON value (or text), e.g. contact.friction=0.4; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
    /// Run only this analysis of the job, and what it needs
    #[arg(long, value_name = "ANALYSIS")]
    pub only: Option<String>,
}

/// The result file of a job when none is named: beside it, with the ending `.h5`.
pub fn default_output(job: &Path) -> PathBuf {
    job.with_extension("h5")
}

/// `Error::Job` if beside the job there is no place for results: it came through a shell (`< JOB`, `<(...)`), not by
/// its name.
pub fn beside(job: &Path) -> Result<PathBuf> {
    let places = ["/dev/stdin", "/dev/fd", "/proc"];
    if std::path::absolute(job).is_ok_and(|p| places.iter().any(|place| p.starts_with(place))) {
        return Err(Error::Job(format!(
            "--output: not given, and the job, {}, has no folder that results could lie in; name one",
            job.display()
        )));
    }
    Ok(default_output(job))
}

#[cfg(test)]
mod tests;
