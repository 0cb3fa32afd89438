//! The guide: from the first mesh to programs of your own. Every command and every block of Rust in it is run by a test.
//!
//! | chapter | what you learn |
//! |---|---|
//! | [`start`] | build the program, mesh a surface of your own, check the result, repair a surface |
//! | [`sizes`] | say how long edges shall be: everywhere, in places, by a formula or a file |
//! | [`regions`] | choose which volumes are filled |
//! | [`subdomains`] | divide a large mesh, limit memory, pass parts to a parallel solver |
//! | [`questions`] | find tetrahedra by place, condition or neighborhood |
//! | [`resaturation`] | mesh some sub-domains again, with other sizes or after damage |
//! | [`pictures`] | draw cuts and surfaces; ParaView, Gmsh, NumPy, DuckDB |
//! | [`scripting`] | JSON output, configuration files, shell completion |
//! | [`library`] | the same from Rust |
//! | [`errors`] | every error code, exit codes, what to do |

pub mod start {
    #![doc = include_str!("start.md")]
}
pub mod sizes {
    #![doc = include_str!("sizes.md")]
}
pub mod regions {
    #![doc = include_str!("regions.md")]
}
pub mod subdomains {
    #![doc = include_str!("subdomains.md")]
}
pub mod questions {
    #![doc = include_str!("questions.md")]
}
pub mod resaturation {
    #![doc = include_str!("resaturation.md")]
}
pub mod pictures {
    #![doc = include_str!("pictures.md")]
}
pub mod scripting {
    #![doc = include_str!("scripting.md")]
}
pub mod library {
    #![doc = include_str!("library.md")]
}
pub mod errors {
    #![doc = include_str!("errors.md")]
}
