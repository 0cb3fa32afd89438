//! The program as its users meet it: processes, files, exit codes.

mod check;
mod crash;
mod damage;
mod errors;
mod forms;
mod guide;
mod json;
mod odd_inputs;
mod people;
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
mod streams;
mod subdomains;
mod together;
mod walls;
mod zone;
