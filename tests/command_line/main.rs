//! The program as its users meet it: processes, files, exit codes.

mod check;
mod crash;
mod damage;
mod errors;
mod exports;
mod forms;
mod guide;
mod json;
mod odd_inputs;
mod pieces;
mod place;
mod query;
mod regions;
mod report;
mod resaturate;
mod same_mesh;
mod shell;
mod silent;
mod size_files;
mod sizes;
mod snapshot;
mod subdomains;
mod zone;
