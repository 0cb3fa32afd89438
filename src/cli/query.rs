//! The command `query`: tetrahedra by position, number, neighborhood or condition.

use super::args::QueryArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::{bad, point, query};
use super::query_rows::{Sink, Writer};
use tetdb_engine::api::error::Error;
use tetdb_engine::api::{
    AnswerColumn, AnswerFile, AnswerRow, Order, PointColumns, PointTable, Settings, Store,
    VARIABLES, check_target, inputs_of,
};

/// Memory for one point while it is answered, in bytes.
const POINT_BYTES: u64 = 512;
/// Position of excess among the variables.
const EXCESS: usize = VARIABLES.len() - 1;
/// Largest number of points answered together.
const POINTS_MAX: u64 = 1 << 17;

pub fn run(args: &QueryArgs, console: &Console) -> Result<u8, Failure> {
    if let Some(out) = &args.output {
        let inputs = inputs_of(&args.store).into_iter().chain(args.points.clone());
        check_target(out, &inputs.collect::<Vec<_>>())?;
    }
    let settings = console.settings(memory::requested(args.memory.as_deref())?, None);
    let columns = columns(args)?;
    let order = order(args)?;
    let mut store = Store::open_with(&args.store, settings.clone())?;
    let n = match args.point.is_empty() && args.points.is_none() {
        true => select(args, &mut store, (columns, order), &settings, console)?,
        false => {
            let mut writer = writer(args, columns, &settings, console)?;
            let n = locate(args, &mut store, settings.cap()? / 8, &mut writer, console)?;
            end(writer, console)?;
            n
        }
    };
    report_count(n, args.limit, &mut store, console)?;
    Ok(0)
}

/// Prints the selected tetrahedra. Returns their number.
fn select(
    args: &QueryArgs,
    store: &mut Store,
    (columns, order): (Vec<AnswerColumn>, Option<(&str, Order)>),
    settings: &Settings,
    console: &Console,
) -> Result<u64, Failure> {
    let mut query = query(args, store)?;
    if columns.contains(&AnswerColumn::Variable(EXCESS)) {
        query = query.with_excess();
    }
    if let Some((variable, order)) = order {
        query = query.order_by(variable, order)?;
    }
    if let Some(limit) = args.limit {
        query = query.limit(usize::try_from(limit).unwrap_or(usize::MAX));
    }
    let mut writer = writer(args, columns, settings, console)?;
    let mut n = 0;
    for hit in query.answers()? {
        n += 1;
        if !writer.put(&hit?.into())? {
            break;
        }
    }
    end(writer, console)?;
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
    Ok(Writer::new(sink, columns, console))
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
    limit: Option<u64>,
    store: &mut Store,
    console: &Console,
) -> Result<(), Failure> {
    let chunks = store.chunk_counts()?;
    console.measures(&serde_json::json!({ "found": n, "chunks": chunks }));
    if !console.is_json() {
        let found = match limit == Some(n) {
            true => format!("{n} shown, as many as were asked for"),
            false => format!("{n} found"),
        };
        console.note(&format!(
            "{found}; read {} of {} chunks of tetrahedra, {} of {} of vertices",
            chunks.tet_chunks_read,
            chunks.tet_chunks,
            chunks.vertex_chunks_read,
            chunks.vertex_chunks
        ));
    }
    Ok(())
}

fn columns(args: &QueryArgs) -> Result<Vec<AnswerColumn>, Failure> {
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
        AnswerColumn::from_name(name).ok_or_else(|| bad("--select", name, &known()))
    });
    let mut columns = columns.collect::<Result<Vec<_>, _>>()?;
    if of_points {
        if columns.contains(&AnswerColumn::Variable(EXCESS)) {
            return Err(bad("--select", "excess", "no excess where points are asked for"));
        }
        columns.insert(0, AnswerColumn::Point);
        columns.push(AnswerColumn::Barycentric);
    }
    Ok(columns)
}

/// The variable by which answers are sorted, and the order.
fn order(args: &QueryArgs) -> Result<Option<(&str, Order)>, Failure> {
    let Some(text) = &args.order_by else {
        return Ok(None);
    };
    let name = text.trim_start_matches('-');
    if !VARIABLES.contains(&name) {
        let known = format!("one of {}", VARIABLES.join(", "));
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
            n += u64::from(found.is_some());
            let row = AnswerRow::from_point(*point, found);
            if !writer.put(&row)? {
                return Ok(false);
            }
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
