//! `query`: tetrahedra by place, number, neighborhood or condition.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, stdin};
use std::path::Path;
use tetdb_schema::code::Code;

use super::args::QueryArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::{bad, point, selection};
use super::query_rows::{FileSink, QueryColumn, Row, Sink, Writer};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Budget, attempt};
use tetdb_engine::api::store::open_finished;
use tetdb_engine::api::targets::{check_target, inputs_of};
use tetdb_store::query::{Hit, Ordered, QueryError, QuerySession, VARIABLES};

/// Memory of a point on its way to its answer.
const POINT_BYTES: u64 = 512;
/// The place of quality among the variables.
const QUALITY: usize = 0;
/// No line of a point is longer.
const LINE_MAX: u64 = 4096;
/// The place of excess.
const EXCESS: usize = VARIABLES.len() - 1;
/// Points answered together, at most.
const POINTS_MAX: u64 = 1 << 17;

pub fn run(args: &QueryArgs, console: &Console) -> Result<u8, Failure> {
    if let Some(out) = &args.output {
        let inputs = inputs_of(&args.store).into_iter().chain(args.points.clone());
        check_target(out, &inputs.collect::<Vec<_>>())?;
    }
    let cap = memory::cap(args.memory.as_deref())?;
    let budget = Budget::new(cap);
    let columns = columns(args)?;
    let order = order(args)?;
    let open = open_finished(&args.store)?;
    let mut inquiry = QuerySession::open(open, &budget)?;
    let lease = budget.lease(cap / 8, "answers")?;
    attempt(|| -> Result<u8, Failure> {
        let n = if args.point.is_empty() && args.points.is_none() {
            let mut selection = selection(args, &mut inquiry)?;
            selection.excess = columns.contains(&QueryColumn::Variable(EXCESS))
                || order.is_some_and(|(variable, _)| variable == EXCESS);
            let mut writer = writer(args, columns, cap, console)?;
            let n = match order {
                Some((QUALITY, descending))
                    if few(args.limit, lease.bytes()) && inquiry.has_extremes(&selection) =>
                {
                    let limit = args.limit.unwrap_or_default() as usize;
                    let found = inquiry.extreme(&selection, descending, limit)?;
                    put(found.into_iter().map(Ok), args.limit, &mut writer)?
                }
                Some((variable, descending)) => {
                    let found = inquiry.select(selection)?;
                    let dir = std::env::temp_dir();
                    let sorted = Ordered::new(found, variable, descending, &dir, lease.bytes())?;
                    put(sorted, args.limit, &mut writer)?
                }
                None => put(inquiry.select(selection)?, args.limit, &mut writer)?,
            };
            end(writer, console)?;
            n
        } else {
            let mut writer = writer(args, columns, cap, console)?;
            let n = locate(args, &mut inquiry, lease.bytes(), &mut writer)?;
            end(writer, console)?;
            n
        };
        tell(n, args.limit, &inquiry, console);
        Ok(0)
    })?
}

/// Whether so many answers are held at once without a thought.
fn few(limit: Option<u64>, memory: u64) -> bool {
    limit.is_some_and(|n| n.saturating_mul(2 * size_of::<Hit>() as u64) <= memory)
}

fn writer(
    args: &QueryArgs,
    columns: Vec<QueryColumn>,
    cap: u64,
    console: &Console,
) -> Result<Writer, Failure> {
    let sink = match &args.output {
        Some(out) => {
            let file = FileSink::new(out, &columns, cap / 16)?;
            Sink::File(Box::new(file), out.clone())
        }
        None if args.json => Sink::Objects,
        None if args.csv => Sink::Values,
        None => Sink::Table,
    };
    Ok(Writer::new(sink, columns, console))
}

fn end(writer: Writer, console: &Console) -> Result<(), Failure> {
    if let Some((path, bytes)) = writer.finish()? {
        let size = memory::show(bytes);
        console.note(&format!("wrote {} ({size})", path.display()));
    }
    Ok(())
}

fn tell(n: u64, limit: Option<u64>, inquiry: &QuerySession, console: &Console) {
    let measures = inquiry.measures();
    console.measures(&serde_json::json!({ "found": n, "chunks": measures }));
    if !console.is_json() {
        let found = match limit == Some(n) {
            true => format!("{n} shown, as many as were asked for"),
            false => format!("{n} found"),
        };
        console.note(&format!(
            "{found}; read {} of {} chunks of tetrahedra, {} of {} of vertices",
            measures.tet_chunks_read,
            measures.tet_chunks,
            measures.vertex_chunks_read,
            measures.vertex_chunks
        ));
    }
}

fn columns(args: &QueryArgs) -> Result<Vec<QueryColumn>, Failure> {
    let of_points = !args.point.is_empty() || args.points.is_some();
    let default = match args.json || args.output.is_some() {
        true => "id,subdomain,region,quality,volume,vertices,points",
        false if of_points => "id,region,quality",
        false => "id,subdomain,region,quality,x,y,z",
    };
    let names = args.select.as_deref().unwrap_or(default);
    let columns = names.split(',').map(|name| {
        let name = name.trim();
        let known = || format!("columns among id, vertices, points, {}", VARIABLES.join(", "));
        QueryColumn::named(name).ok_or_else(|| bad("--select", name, &known()))
    });
    let mut columns = columns.collect::<Result<Vec<_>, _>>()?;
    if of_points {
        if columns.contains(&QueryColumn::Variable(EXCESS)) {
            return Err(bad("--select", "excess", "no excess where points are asked for"));
        }
        columns.insert(0, QueryColumn::Point);
        columns.push(QueryColumn::Barycentric);
    }
    Ok(columns)
}

/// The variable answers are sorted by, and whether they fall.
fn order(args: &QueryArgs) -> Result<Option<(usize, bool)>, Failure> {
    let Some(text) = &args.order_by else {
        return Ok(None);
    };
    let falling = text.starts_with('-');
    let name = text.trim_start_matches('-');
    match VARIABLES.iter().position(|v| *v == name) {
        Some(variable) => Ok(Some((variable, falling != args.desc))),
        None => {
            let known = format!("one of {}", VARIABLES.join(", "));
            Err(bad("--order-by", text, &known))
        }
    }
}

fn put(
    found: impl Iterator<Item = Result<Hit, QueryError>>,
    limit: Option<u64>,
    writer: &mut Writer,
) -> Result<u64, Failure> {
    let mut n = 0;
    let limit = limit.map_or(usize::MAX, |n| usize::try_from(n).unwrap_or(usize::MAX));
    for found in found.take(limit) {
        n += 1;
        let row = Row { found: Some(found?), located: None };
        if !writer.put(&row)? {
            break;
        }
    }
    Ok(n)
}

/// Answers points in blocks that fit the memory. Returns how many are in the mesh.
fn locate(
    args: &QueryArgs,
    inquiry: &mut QuerySession,
    memory: u64,
    writer: &mut Writer,
) -> Result<u64, Failure> {
    let block = (memory / POINT_BYTES).clamp(1, POINTS_MAX) as usize;
    let mut points = Vec::new();
    let mut n = 0;
    for text in &args.point {
        points.push(point("--point", text)?);
    }
    let mut answer = |points: &mut Vec<Point>, writer: &mut Writer| -> Result<bool, Failure> {
        for located in inquiry.locate(points)? {
            n += u64::from(located.found.is_some());
            let row = Row { found: located.found, located: Some(located) };
            if !writer.put(&row)? {
                return Ok(false);
            }
        }
        points.clear();
        Ok(true)
    };
    if let Some(path) = &args.points {
        let mut from = opened(path)?;
        for number in 1u64.. {
            let Some(line) = line(&mut from).map_err(|e| unreadable(path, &e))? else {
                break;
            };
            points.extend(parse_line(path, number, &line)?);
            if points.len() >= block && !answer(&mut points, writer)? {
                return Ok(n);
            }
        }
    }
    answer(&mut points, writer)?;
    Ok(n)
}

fn opened(path: &Path) -> Result<Box<dyn BufRead>, Failure> {
    if path == Path::new("-") {
        return Ok(Box::new(stdin().lock()));
    }
    let file = File::open(path).map_err(|e| unreadable(path, &e))?;
    Ok(Box::new(BufReader::new(file)))
}

/// The next line, or `None` at the end. Errors: one too long for three numbers, as a device without end gives.
fn line(from: &mut dyn BufRead) -> std::io::Result<Option<String>> {
    let mut line = String::new();
    let n = from.take(LINE_MAX).read_line(&mut line)?;
    if n as u64 == LINE_MAX && !line.ends_with('\n') {
        let why = format!("a line is longer than {LINE_MAX} bytes");
        return Err(std::io::Error::other(why));
    }
    Ok((n > 0).then_some(line))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(Code::UnreadableFile, format!("the points cannot be read: {error}"))
        .at(path.display())
        .help("check the path and its permissions")
}

/// Three numbers with commas or spaces between; nothing in empty lines and behind `#`.
fn parse_line(path: &Path, number: u64, line: &str) -> Result<Option<Point>, Failure> {
    let text = line.split('#').next().unwrap_or_default().trim();
    if text.is_empty() {
        return Ok(None);
    }
    let words: Vec<&str> = text
        .split(|c: char| c == ',' || c.is_whitespace())
        .filter(|word| !word.is_empty())
        .collect();
    let fault = |code, message: String| {
        Failure::new(code, message)
            .at(format!("{}, line {number}", path.display()))
            .help("write a point a line: 0.1,0.2,0.3 or 0.1 0.2 0.3")
    };
    let mut point = [0.0; 3];
    if words.len() != 3 {
        let message = format!("expected three coordinates, found {}", words.len());
        return Err(fault(Code::UnexpectedText, message));
    }
    for (x, word) in point.iter_mut().zip(&words) {
        *x = word.parse().unwrap_or(f64::NAN);
        if !x.is_finite() {
            let message = format!("{word} is not a finite number");
            return Err(fault(Code::NotANumber, message));
        }
    }
    Ok(Some(Point::from_array(point)))
}
