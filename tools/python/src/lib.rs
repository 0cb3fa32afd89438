//! The native half of the Python package `tetdb`: arrays in and out of the library's front door.
//!
//! Reading order: `failure` (errors), `watched` (work that can be interrupted), `surface`, `sizes` and `run` (what is asked for), `tasks` (many processes), `store`,
//! `part`, `field` and `arrow` (a finished mesh). Shapes, defaults, docstrings and reports are the Python half's; this half checks nothing that half has
//! checked, and the library checks the rest. Is not: public; its names may change.

mod arrow;
mod failure;
mod field;
mod part;
mod run;
mod sizes;
mod store;
mod surface;
mod tasks;
mod watched;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::arrow::ArrowStream;
    #[pymodule_export]
    use super::field::Field;
    #[pymodule_export]
    use super::part::{Part, qualities};
    #[pymodule_export]
    use super::run::{import_mesh, mesh, predict, resume};
    #[pymodule_export]
    use super::store::Store;
    #[pymodule_export]
    use super::surface::Surface;
    #[pymodule_export]
    use super::tasks::{gather, plan, run_task};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        let codes = tetdb::Code::ALL.iter().map(|code| code.as_str());
        module.add("CODES", codes.collect::<Vec<_>>())
    }
}
