//! Names of labels and regions for programs that restrict them.

use std::collections::{BTreeMap, BTreeSet};

/// A name for Gmsh, where a name ends at the next quote or line.
pub(super) fn quotable(name: &str) -> String {
    name.replace('"', "'").replace(['\n', '\r'], " ")
}

/// Text in XML, without the characters that XML has not.
pub(super) fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('"', "&quot;");
    let text = text.replace('<', "&lt;").replace('>', "&gt;");
    text.replace(char::is_control, " ")
}

/// Names for Abaqus, Exodus and OpenFOAM: letters, digits, `_` and `-`, a letter first, at most 80 characters, distinct without regard to case.
pub(super) fn set_names(labels: &BTreeMap<u32, String>) -> BTreeMap<u32, String> {
    let mut taken = BTreeSet::new();
    let mut names = BTreeMap::new();
    for (&label, name) in labels {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let mut clean: String = name.chars().map(|c| if letter(c) { c } else { '_' }).collect();
        if !clean.starts_with(|c: char| c.is_ascii_alphabetic()) {
            clean.insert_str(0, "label_");
        }
        clean.truncate(60);
        if !taken.insert(clean.to_ascii_lowercase()) {
            clean += &format!("_{label}");
            taken.insert(clean.to_ascii_lowercase());
        }
        names.insert(label, clean);
    }
    names
}
