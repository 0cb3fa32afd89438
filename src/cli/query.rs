//! The command `query`: tetrahedra by position, number, neighborhood or condition.

use std::io::{IsTerminal, stdout};

use super::args::QueryArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::{bad, point, query};
use super::query_rows::{Sink, Writer};
use super::words::count;
use tetdb_engine::api::error::Error;
use tetdb_engine::api::{
    AnswerColumn, AnswerFile, AnswerRow, Order, PointColumns, PointTable, Settings, Store,
    VARIABLES, check_target, inputs_of,
};

/// Memory for one point while it is answered, in bytes.
const POINT_BYTES: u64 = 512;
/// Rows shown on a terminal of an answer that has no condition and no limit; some 100,000 a second scroll by otherwise.
const ROWS_SHOWN: u64 = 20;
/// Position of excess among the variables.
const EXCESS: usize = VARIABLES.len() - 1;
/// Largest number of points answered together.
const POINTS_MAX: u64 = 1 << 17;

pub fn run(args: &QueryArgs, console: &Console) -> Result<u8, Failure> {
    if let Some(out) = &args.output {
        let inputs = inputs_of(&args.store).into_iter().chain(args.points.clone());
        check_target(out, &inputs.collect::<Vec<_>>())?;
    }
    let settings = args.at.of(console.settings(memory::requested(args.memory.as_deref())?, None));
    let mut store = Store::open_with(&args.store, settings.clone())?;
    let columns = columns(args, &store)?;
    let order = order(args, &store)?;
    let mut writer = writer(args, columns.clone(), &settings, console)?;
    let n = match args.point.is_empty() && args.points.is_none() {
        true => select(args, &mut store, (columns, order), &mut writer)?,
        false => locate(args, &mut store, settings.cap()? / 8, &mut writer, console)?,
    };
    let is_cut = writer.is_cut();
    end(writer, console)?;
    report_count(n, (args.limit, is_cut), &mut store, console)?;
    if is_cut {
        let limit = if args.points.is_some() { "" } else { ", --limit N the first N" };
        console.note(&format!(
            "only the first {ROWS_SHOWN} rows are shown on a terminal; `| cat` or -o FILE gives all{limit}"
        ));
    }
    Ok(0)
}

/// Prints the selected tetrahedra. Returns their number.
fn select(
    args: &QueryArgs,
    store: &mut Store,
    (columns, order): (Vec<AnswerColumn>, Option<(&str, Order)>),
    writer: &mut Writer,
) -> Result<u64, Failure> {
    let mut query = query(args, store)?.with_columns(&columns)?;
    if columns.contains(&AnswerColumn::Variable(EXCESS)) {
        query = query.with_excess();
    }
    if let Some((variable, order)) = order {
        query = query.order_by(variable, order)?;
    }
    // One more than is shown tells whether there are more.
    if let Some(limit) = args.limit.or(writer.rows_max().map(|n| n + 1)) {
        query = query.limit(usize::try_from(limit).unwrap_or(usize::MAX));
    }
    let mut n = 0;
    for hit in query.answers()? {
        if !writer.put(&hit?.into())? {
            break;
        }
        n += 1;
    }
    Ok(n)
}

fn writer(
    args: &QueryArgs,
    columns: Vec<AnswerColumn>,
    settings: &Settings,
    console: &Console,
) -> Result<Writer, Failure> {
    let sink = match &args.output {
        Some(out) => {
            let file = AnswerFile::create(out, &columns, settings)?;
            Sink::File(Box::new(file), out.clone())
        }
        None if args.json => Sink::Objects,
        None if args.csv => Sink::Values,
        None => Sink::Table,
    };
    let is_long = args.points.is_some() || args.point.is_empty() && !args.has_condition();
    let is_cut = is_long && args.limit.is_none() && stdout().is_terminal();
    let rows_max = (is_cut && matches!(sink, Sink::Table)).then_some(ROWS_SHOWN);
    Ok(Writer::new(sink, columns, rows_max, console))
}

fn end(writer: Writer, console: &Console) -> Result<(), Failure> {
    if let Some((path, bytes)) = writer.finish()? {
        let size = memory::show(bytes);
        console.note(&format!("wrote {} ({size})", path.display()));
    }
    Ok(())
}

fn report_count(
    n: u64,
    (limit, is_cut): (Option<u64>, bool),
    store: &mut Store,
    console: &Console,
) -> Result<(), Failure> {
    let chunks = store.chunk_counts()?;
    console.measures(&serde_json::json!({ "found": n, "chunks": chunks }));
    if !console.is_json() {
        let found = match limit == Some(n) {
            _ if is_cut => format!("{n} shown"),
            true => format!("{n} shown, as many as were asked for"),
            false => format!("{n} found"),
        };
        console.note(&format!(
            "{found}; read {} of {} of tetrahedra, {} of {} of vertices",
            chunks.tet_chunks_read,
            count(chunks.tet_chunks, "chunk"),
            chunks.vertex_chunks_read,
            chunks.vertex_chunks
        ));
    }
    Ok(())
}

fn columns(args: &QueryArgs, store: &Store) -> Result<Vec<AnswerColumn>, Failure> {
    let of_points = !args.point.is_empty() || args.points.is_some();
    let default = match args.json || args.output.is_some() {
        true => "id,subdomain,region,quality,volume,vertices,points",
        false if of_points => "id,region,quality",
        false => "id,subdomain,region,quality,x,y,z",
    };
    let names = args.select.as_deref().unwrap_or(default);
    let names: Vec<&str> = names.split(',').map(str::trim).collect();
    let found = store.answer_columns(&names)?;
    let columns = names.iter().zip(found).map(|(name, column)| {
        let known = format!("columns among id, vertices, points, {}", variables(store)?.join(", "));
        column.ok_or_else(|| bad("--select", name, &known))
    });
    let mut columns = columns.collect::<Result<Vec<_>, _>>()?;
    if of_points {
        if columns.contains(&AnswerColumn::Variable(EXCESS)) {
            return Err(bad("--select", "excess", "no excess where points are asked for"));
        }
        if let Some(field) = columns.iter().find(|c| matches!(c, AnswerColumn::Field { .. })) {
            return Err(bad("--select", field.name(), "no field where points are asked for"));
        }
        columns.insert(0, AnswerColumn::Point);
        columns.push(AnswerColumn::Barycentric);
    }
    Ok(columns)
}

/// Names of all numbers of a tetrahedron.
fn variables(store: &Store) -> Result<Vec<String>, Failure> {
    let fields = store.fields()?.into_iter().flat_map(|field| field.columns);
    Ok(VARIABLES.iter().map(|name| (*name).to_owned()).chain(fields).collect())
}

/// The variable by which answers are sorted, and the order.
fn order<'a>(args: &'a QueryArgs, store: &Store) -> Result<Option<(&'a str, Order)>, Failure> {
    let Some(text) = &args.order_by else {
        return Ok(None);
    };
    let name = text.trim_start_matches('-');
    let known = variables(store)?;
    if !known.iter().any(|known| known == name) {
        let known = format!("one of {}", known.join(", "));
        return Err(bad("--order-by", text, &known));
    }
    let order = match text.starts_with('-') != args.desc {
        true => Order::Falling,
        false => Order::Rising,
    };
    Ok(Some((name, order)))
}

/// Answers points in blocks that fit in memory. Returns the number of points inside the mesh.
fn locate(
    args: &QueryArgs,
    store: &mut Store,
    memory: u64,
    writer: &mut Writer,
    console: &Console,
) -> Result<u64, Failure> {
    let block = (memory / POINT_BYTES).clamp(1, POINTS_MAX) as usize;
    let mut points = Vec::new();
    let mut n = 0;
    for text in &args.point {
        points.push(point("--point", text)?);
    }
    let mut answer = |points: &mut Vec<[f64; 3]>, writer: &mut Writer| -> Result<bool, Failure> {
        for (point, found) in points.iter().zip(store.locate_barycentric(points)?) {
            let is_found = found.is_some();
            if !writer.put(&AnswerRow::from_point(*point, found))? {
                return Ok(false);
            }
            n += u64::from(is_found);
        }
        points.clear();
        Ok(true)
    };
    if let Some(path) = &args.points {
        let mut is_named = false;
        for row in PointTable::open(path, PointColumns::Named, memory).map_err(Error::from)? {
            let row = row.map_err(Error::from)?;
            is_named |= !row.name.is_empty();
            points.push([0, 1, 2].map(|axis| row.numbers[axis]));
            if points.len() >= block && !answer(&mut points, writer)? {
                return Ok(n);
            }
        }
        if is_named {
            console.note("note: points are answered in their order, without their names");
        }
    }
    answer(&mut points, writer)?;
    Ok(n)
}
