//! Questions of the page of `view`, and their answers.

use serde_json::{Value, json};

use super::failure::Failure;
use super::view_http::{Answer, random_token};
use tetdb_engine::api::{
    AnswerColumn, AnswerRow, Code, DrawnTriangles, Error, PickedTet, Scalar, Viewer,
};

/// Columns of a picked tetrahedron.
const COLUMNS: [&str; 11] = [
    "id",
    "subdomain",
    "region",
    "quality",
    "volume",
    "edge_min",
    "edge_max",
    "angle_min",
    "angle_max",
    "vertices",
    "points",
];

type Line = [[f64; 3]; 2];

/// A question to a viewer.
#[derive(Debug)]
pub enum Call {
    Page,
    Boundary(u32),
    Interfaces(u32),
    Section { plane: Line, value: String, condition: Option<String> },
    Answers { condition: String, value: String },
    Pick { ray: Line, clip: Option<Line>, condition: Option<String>, hidden: Vec<u32> },
}

/// The parameters of a request that are not read yet.
struct Parameters<'a>(Vec<&'a (String, String)>);

impl Parameters<'_> {
    /// Takes a parameter; an empty one is as none. Errors: it is given twice.
    fn take(&mut self, name: &str) -> Result<Option<String>, Answer> {
        let found: Vec<_> = self.0.extract_if(.., |(own, _)| own == name).collect();
        match &found[..] {
            [] => Ok(None),
            [(_, value)] => Ok(Some(value.clone()).filter(|value| !value.is_empty())),
            _ => Err(bad(format!("{name}: expected once"))),
        }
    }

    fn need(&mut self, name: &str) -> Result<String, Answer> {
        self.take(name)?.ok_or_else(|| bad(format!("the parameter {name} is missing")))
    }

    fn share(&mut self) -> Result<u32, Answer> {
        let text = self.need("share")?;
        text.parse().map_err(|_| bad(format!("share {text}: expected a whole number")))
    }

    fn line(&mut self, name: &str) -> Result<Option<Line>, Answer> {
        let Some(text) = self.take(name)? else {
            return Ok(None);
        };
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|word| word.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some([a, b, c, d, e, f]) => Ok(Some([[*a, *b, *c], [*d, *e, *f]])),
            _ => Err(bad(format!("{name} {text}: expected six numbers with commas between them"))),
        }
    }

    fn need_line(&mut self, name: &str) -> Result<Line, Answer> {
        self.line(name)?.ok_or_else(|| bad(format!("{name}: expected six numbers")))
    }

    fn ranks(&mut self, name: &str) -> Result<Vec<u32>, Answer> {
        let text = self.take(name)?.unwrap_or_default();
        let words = text.split(',').filter(|word| !word.is_empty());
        let ranks: Result<_, _> = words.map(str::parse).collect();
        ranks.map_err(|_| {
            bad(format!("{name} {text}: expected whole numbers with commas between them"))
        })
    }
}

fn bad(why: String) -> Answer {
    Answer::refusal(400, why)
}

impl Call {
    /// Reads a request. Errors: an unknown path; bad parameters.
    pub fn parse(path: &str, parameters: &[(String, String)]) -> Result<Self, Answer> {
        let mut own = Parameters(parameters.iter().collect());
        let value = |own: &mut Parameters| Ok(own.take("value")?.unwrap_or("quality".into()));
        let call = match path {
            // Its one parameter is the token.
            "/" => return Ok(Self::Page),
            "/boundary" => Self::Boundary(own.share()?),
            "/interfaces" => Self::Interfaces(own.share()?),
            "/section" => Self::Section {
                plane: own.need_line("plane")?,
                value: value(&mut own)?,
                condition: own.take("where")?,
            },
            "/answers" => Self::Answers { condition: own.need("where")?, value: value(&mut own)? },
            "/pick" => Self::Pick {
                ray: own.need_line("ray")?,
                clip: own.line("clip")?,
                condition: own.take("where")?,
                hidden: own.ranks("hidden")?,
            },
            _ => return Err(Answer::refusal(404, "there is no such page")),
        };
        match own.0.first() {
            Some((name, _)) => Err(bad(format!("{name}: not a parameter of {path}"))),
            None => Ok(call),
        }
    }

    /// Returns whether the answer may read much of the store.
    pub fn is_long(&self) -> bool {
        matches!(self, Self::Boundary(_) | Self::Interfaces(_) | Self::Answers { .. })
    }

    /// Asks the viewer. `token`: for the page.
    pub fn answer(self, viewer: &mut Viewer, token: &str) -> Answer {
        let drawn = match self {
            Self::Page => return page(viewer, token),
            Self::Boundary(share) => viewer.boundary(share),
            Self::Interfaces(share) => viewer.interfaces(share),
            Self::Section { plane, value, condition } => {
                viewer.section(plane, &value, condition.as_deref())
            }
            Self::Answers { condition, value } => viewer.answers(&condition, &value),
            Self::Pick { ray, clip, condition, hidden } => {
                let picked = viewer.pick(ray, clip, condition.as_deref(), &hidden);
                return match picked {
                    Ok(picked) => Answer::json(200, &picked.map_or(Value::Null, row)),
                    Err(error) => refused(error),
                };
            }
        };
        match drawn.map(|drawn: DrawnTriangles| viewer.message(&drawn)) {
            Ok(body) => Answer::bytes(body),
            Err(error) => refused(error),
        }
    }
}

fn page(viewer: &mut Viewer, token: &str) -> Answer {
    let Ok(nonce) = random_token() else {
        return Answer::refusal(500, "the system gives no random numbers");
    };
    match viewer.page(token, &nonce) {
        Ok(page) => Answer {
            status: 200,
            kind: "text/html; charset=utf-8",
            body: page.into_bytes(),
            nonce: Some(nonce),
        },
        Err(error) => refused(error),
    }
}

fn row(picked: PickedTet) -> Value {
    let columns: Vec<AnswerColumn> =
        COLUMNS.into_iter().filter_map(AnswerColumn::from_name).collect();
    let mut row = AnswerRow::from(picked.hit).object(&columns);
    row["point"] = json!(picked.point.to_array());
    let fields = picked.fields.into_iter().map(|(name, value)| match value {
        Scalar::Int(n) => json!([name, n]),
        Scalar::Float(x) => json!([name, x]),
    });
    row["fields"] = fields.collect();
    row
}

/// An error of a call, with its code.
fn refused(error: Error) -> Answer {
    let status = match error.code() {
        Code::BadQuery | Code::BadExpression | Code::NoSuchPart => 400,
        Code::Stopped => 503,
        _ => 500,
    };
    let failure = Failure::from(error);
    let error = json!({ "code": failure.code, "message": failure.message, "where": failure.place, "help": failure.help });
    Answer::json(status, &json!({ "error": error }))
}
