//! The HTML page about a mesh: one file with all contents, for a browser without a network.
//!
//! The page's own text, style and program are files in `assets`. The facts about a mesh are added as data: a JSON object, and
//! surfaces packed as text. They are written to the file one after another.

mod pack;

use std::path::Path;

pub use pack::{Surface, packed};

use tetdb_base::geom::Aabb;
use tetdb_io::write::{TextFile, WriteError};

type Result<T> = std::result::Result<T, WriteError>;

/// File endings of the format.
pub const ENDINGS: &str = ".html or .htm";

const BODY: &str = include_str!("assets/page.html");
const LIVE_BODY: &str = include_str!("assets/live.html");
const STYLE: &str = include_str!("assets/page.css");
const LIVE_STYLE: &str = include_str!("assets/live.css");
/// Scripts in the order in which they run.
const PROGRAM: [&str; 6] = [
    TOOLS,
    CHARTS,
    include_str!("assets/page.js"),
    VIEW,
    HANDS,
    include_str!("assets/controls.js"),
];
const LIVE_PROGRAM: [&str; 5] = [TOOLS, CHARTS, VIEW, HANDS, include_str!("assets/live.js")];
const TOOLS: &str = include_str!("assets/tools.js");
const CHARTS: &str = include_str!("assets/charts.js");
const VIEW: &str = include_str!("assets/view.js");
const HANDS: &str = include_str!("assets/hands.js");

/// A page under construction; its file gets its name in [`Page::finish`].
pub struct Page {
    file: TextFile,
    bounds: Aabb,
}

/// Returns true if the name has the ending of a page.
pub fn is_page(out: &Path) -> bool {
    let ending = out.extension().and_then(|e| e.to_str());
    ending.is_some_and(|e| ["html", "htm"].contains(&e.to_ascii_lowercase().as_str()))
}

impl Page {
    /// Begins the page `out`; its surfaces lie within `bounds`. Errors: another ending; a folder that cannot be written.
    pub fn new(out: &Path, title: &str, bounds: Aabb) -> Result<Self> {
        if !is_page(out) {
            return Err(WriteError::UnknownFormat { path: out.to_owned(), known: ENDINGS });
        }
        let mut file = TextFile::new(out)?;
        file.line("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">")?;
        file.line("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">")?;
        // The policy forbids all network access.
        file.line("<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">")?;
        file.line("<link rel=\"icon\" href=\"data:,\">")?;
        file.line(&format!("<title>{} – tetdb</title>", escaped(title)))?;
        file.line(&format!("<style>\n{STYLE}</style>\n</head>\n<body>"))?;
        file.line(BODY)?;
        Ok(Self { file, bounds })
    }

    /// Adds a surface under a name. Errors: the disk.
    pub fn surface(&mut self, name: &str, surface: &Surface) -> Result<()> {
        let text = pack::pack(surface, &self.bounds);
        self.file
            .line(&format!("<script type=\"text/plain\" id=\"surface-{name}\">{text}</script>"))
    }

    /// Adds the data about the mesh and the program; returns the length of the file. Errors: the disk.
    pub fn finish(mut self, data: &serde_json::Value) -> Result<u64> {
        self.file.line("<script type=\"application/json\" id=\"data\">")?;
        self.file.line(&inert(&data.to_string()))?;
        self.file.line("</script>")?;
        for part in PROGRAM {
            self.file.line(&format!("<script>\n{part}</script>"))?;
        }
        self.file.line("</body>\n</html>")?;
        self.file.finish()
    }
}

/// The page of a viewer, which asks the server it comes from for all else. Only elements with `nonce` run.
pub fn live(title: &str, data: &serde_json::Value, nonce: &str) -> String {
    let (title, data) = (escaped(title), inert(&data.to_string()));
    let scripts = LIVE_PROGRAM.map(|part| format!("<script nonce=\"{nonce}\">\n{part}</script>\n"));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} – tetdb</title>\n<style nonce=\"{nonce}\">\n{STYLE}{LIVE_STYLE}</style>\n</head>\n<body>\n{LIVE_BODY}\n\
         <script type=\"application/json\" id=\"data\">{data}</script>\n{}</body>\n</html>\n",
        scripts.concat()
    )
}

/// Escapes JSON so that its strings can neither end a script nor begin a comment; `<` occurs only in strings.
fn inert(json: &str) -> String {
    json.replace('<', "\\u003c")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::Point;

    #[test]
    fn a_name_cannot_break_out_of_the_page() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let out = dir.path().join("a.html");
        let bounds = Aabb { low: Point::ZERO, high: Point::ONE };
        let name = "</script><script>alert(1)</script><!--";
        let page = Page::new(&out, name, bounds).expect("the folder is there");
        let data = serde_json::json!({ "title": name });
        let bytes = page.finish(&data).expect("the disk has room");
        let text = std::fs::read_to_string(&out).expect("it was written");
        assert_eq!(text.len() as u64, bytes);
        assert!(!text.contains("alert(1)</script>") && !text.contains("<!--"));
        let json = text.split("id=\"data\">").nth(1).expect("the data");
        let json = json.split("</script>").next().expect("its end");
        assert_eq!(serde_json::from_str::<serde_json::Value>(json).ok(), Some(data));
        for other in ["a.txt", "html"] {
            assert!(Page::new(&dir.path().join(other), "", bounds).is_err());
        }
    }

    #[test]
    fn a_page_asks_nobody() {
        let parts = PROGRAM.into_iter().chain(LIVE_PROGRAM);
        for part in parts.chain([BODY, STYLE, LIVE_BODY, LIVE_STYLE]) {
            for word in ["fetch(", "XMLHttpRequest", "import ", "src=", "url("] {
                // That of a viewer asks its server, at one place.
                let n = usize::from(word == "fetch(" && part.contains("fetch(`/${path}?"));
                assert_eq!(part.matches(word).count(), n, "{word}");
            }
            let links = part.replace("http://www.w3.org/2000/svg", "");
            assert!(!links.contains("http"), "only the name of SVG is a link");
        }
    }
}
