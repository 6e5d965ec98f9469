//! The program as its users call it: real processes, under `mpirun` where there are several ranks.

mod bad_input;
mod creep_curve;
mod cycles;
mod damaged;
mod drawn;
mod failures;
mod golden;
mod interrupted;
mod matrices;
mod one_point;
mod out_of_core;
mod placement;
mod points;
mod program;
mod rail;
mod results;
mod reuse;
mod rotation;
mod runs;
mod sensitivities;
mod slurm;
mod sound;
mod sweep;
mod swept;
mod transient;
mod usage;
