//! The guide: from the first mesh to programs of your own. Every command and every block of Rust in it is run by a test.
//!
//! | chapter | what you learn |
//! |---|---|
//! | [`start`] | build the program, mesh a surface of your own, check the result |
//! | [`repair`] | mesh surfaces with cracks, holes and crossings, and soups |
//! | [`sizes`] | say how long edges should be: everywhere, in places, by a formula or a file |
//! | [`regions`] | choose which volumes are filled |
//! | [`subdomains`] | divide a large mesh, limit memory, pass parts to a parallel solver |
//! | [`import`] | take over meshes of other programs |
//! | [`cluster`] | share a mesh among the machines of a cluster |
//! | [`questions`] | find tetrahedra by place, condition or neighborhood |
//! | [`fields`] | keep values at vertices and tetrahedra, ask for them, export them |
//! | [`resaturation`] | mesh some sub-domains again, with other sizes or after damage |
//! | [`pictures`] | draw cuts and surfaces; look at a store in the browser |
//! | [`exports`] | files for VTK, OpenFOAM, Gmsh, NumPy, DuckDB and others |
//! | [`scripting`] | JSON output, configuration files, shell completion |
//! | [`library`] | the same from Rust |
//! | [`python`] | the same from Python, in arrays |
//! | [`stability`] | what a new version may change, and what stays the same |
//! | [`errors`] | every error code, exit codes, what to do |

/// Where the chapters' links lead here. In a chapter's file the same links lead to files; what comes first counts.
macro_rules! links {
    () => {
        concat!(
            "[start]: crate::guide::start\n",
            "[sizes]: crate::guide::sizes\n",
            "[regions]: crate::guide::regions\n",
            "[repair]: crate::guide::repair\n",
            "[subdomains]: crate::guide::subdomains\n",
            "[import]: crate::guide::import\n",
            "[cluster]: crate::guide::cluster\n",
            "[questions]: crate::guide::questions\n",
            "[fields]: crate::guide::fields\n",
            "[resaturation]: crate::guide::resaturation\n",
            "[pictures]: crate::guide::pictures\n",
            "[exports]: crate::guide::exports\n",
            "[scripting]: crate::guide::scripting\n",
            "[library]: crate::guide::library\n",
            "[python]: crate::guide::python\n",
            "[stability]: crate::guide::stability\n",
            "[errors]: crate::guide::errors\n",
            "[`Surface`]: crate::Surface\n",
            "[`Mesher`]: crate::Mesher\n",
            "[`Store`]: crate::Store\n",
            "[`Tasks`]: crate::Tasks\n",
            "[`Existing::Replace`]: crate::Existing::Replace\n",
            "[`Mesher::predict`]: crate::Mesher::predict\n",
            "[`SealedTet`]: crate::data::schema::record::SealedTet\n",
            "[`SealedVertex`]: crate::data::schema::record::SealedVertex\n",
            "[`Error`]: crate::Error\n",
        )
    };
}

pub mod start {
    #![doc = links!()]
    #![doc = include_str!("start.md")]
}
pub mod sizes {
    #![doc = links!()]
    #![doc = include_str!("sizes.md")]
}
pub mod repair {
    #![doc = links!()]
    #![doc = include_str!("repair.md")]
}
pub mod regions {
    #![doc = links!()]
    #![doc = include_str!("regions.md")]
}
pub mod subdomains {
    #![doc = links!()]
    #![doc = include_str!("subdomains.md")]
}
pub mod import {
    #![doc = links!()]
    #![doc = include_str!("import.md")]
}
pub mod cluster {
    #![doc = links!()]
    #![doc = include_str!("cluster.md")]
}
pub mod questions {
    #![doc = links!()]
    #![doc = include_str!("questions.md")]
}
pub mod fields {
    #![doc = links!()]
    #![doc = include_str!("fields.md")]
}
pub mod resaturation {
    #![doc = links!()]
    #![doc = include_str!("resaturation.md")]
}
pub mod pictures {
    #![doc = links!()]
    #![doc = include_str!("pictures.md")]
}
pub mod exports {
    #![doc = links!()]
    #![doc = include_str!("exports.md")]
}
pub mod scripting {
    #![doc = links!()]
    #![doc = include_str!("scripting.md")]
}
pub mod library {
    #![doc = links!()]
    #![doc = include_str!("library.md")]
}
pub mod python {
    #![doc = links!()]
    #![doc = include_str!("python.md")]
}
pub mod stability {
    #![doc = links!()]
    #![doc = include_str!("stability.md")]
}
pub mod errors {
    #![doc = links!()]
    #![doc = include_str!("errors.md")]
}
