//! `field`: values kept with a finished mesh.
//!
//! Why: values that belong to another mesh, or half of them, are worse than none.
//! How: known values are added in every way and read back; bad input, damage and kills leave the store as it was or say where it is not.

use super::place::Place;
use serde_json::Value;

/// A store of two sub-domains.
fn two(place: &Place) {
    place.run_line("mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify").succeeds();
}

fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.as_bytes());
    bytes.extend(data);
    bytes
}

pub fn fields(place: &Place, store: &str) -> Vec<Value> {
    let list = place.run_line(&format!("field {store} list --json")).succeeds().json();
    list["fields"].as_array().expect("a list").clone()
}

fn digest(place: &Place, name: &str) -> String {
    let all = fields(place, "a.tetdb");
    let field = all.iter().find(|field| field["name"] == name);
    field.unwrap_or_else(|| panic!("no {name}"))["digest"].to_string()
}

/// Rows of the data of an array file of doubles.
pub fn doubles(place: &Place, file: &str) -> Vec<f64> {
    let bytes = std::fs::read(place.path(file)).expect("the file is there");
    let head = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let words = bytes[head..].chunks_exact(8);
    words.map(|word| f64::from_le_bytes(word.try_into().expect("eight bytes"))).collect()
}

/// The same values from an expression, an array in the order of an export, and a table by id, in any order, have one digest.
#[test]
fn values_are_the_same_whatever_they_come_from() {
    let place = Place::new();
    two(&place);
    place.run_line("export a.tetdb m.npy").succeeds();
    let points = doubles(&place, "m_points.npy");
    let values: Vec<u8> = points.chunks(3).flat_map(|p| (2.0 * p[0]).to_le_bytes()).collect();
    place.write("t.npy", npy("<f8", &format!("({},)", points.len() / 3), &values));
    std::fs::copy(place.path("m_vertex_id.npy"), place.path("ids.npy")).expect("it is there");
    let ids = doubles(&place, "m_vertex_id.npy");
    let mut lines: Vec<String> = (points.chunks(3).zip(&ids))
        .map(|(p, id)| format!("{},{}\n", id.to_bits(), 2.0 * p[0]))
        .collect();
    lines.reverse();
    place.write("t.csv", format!("id,T\n{}", lines.concat()));
    let by_number: Vec<String> =
        points.chunks(3).enumerate().map(|(i, p)| format!("{i} {}\n", 2.0 * p[0])).collect();
    place.write("n.csv", format!("id T\n{}", by_number.concat()));
    for (name, from) in [
        ("e", "2*x"),
        ("npy", "t.npy"),
        ("csv", "t.csv --memory 96MiB"),
        ("ids", "t.npy --ids ids.npy"),
        ("numbers", "n.csv --ids export"),
    ] {
        let line = format!("field a.tetdb add {name} --at vertices --from {from} --json");
        let added = place.run_line(&line).succeeds().json();
        assert_eq!(added["field"]["type"], "f64");
        assert_eq!(digest(&place, name), digest(&place, "e"), "{name}");
    }
    // At tetrahedra: an expression of their columns, and a table of them.
    place.run_line("field a.tetdb add q --at tets --from quality --type f32").succeeds();
    let rows = place.run_line("query a.tetdb --select id,quality --csv").succeeds().stdout();
    let mut rows: Vec<&str> = rows.lines().skip(1).collect();
    rows.sort_unstable();
    place.write("q.csv", rows.join("\n"));
    let line = "field a.tetdb add r --at tets --from q.csv --ids stable --type f32";
    place.run_line(line).succeeds();
    assert_eq!(digest(&place, "q"), digest(&place, "r"));
    place.run_line("field a.tetdb add v --at vertices --from -y,x,0").succeeds();
    let v = &fields(&place, "a.tetdb")[7];
    assert_eq!((&v["components"], &v["columns"][2]), (&3.into(), &"v.z".into()));
    place.run_line("verify a.tetdb").succeeds();
    place.run_line("field a.tetdb drop e").succeeds();
    assert_eq!(fields(&place, "a.tetdb").len(), 7);
    assert!(!place.names().iter().any(|name| name.contains("-new") || name.contains("scratch/")));
    // One that is refused drops nothing.
    let line = "resaturate a.tetdb --subdomain 1 --refine-by 0.8 --drop-fields --memory 1MiB";
    assert_ne!(place.run_line(line).exit(), Some(0));
    assert_eq!(fields(&place, "a.tetdb").len(), 7);
    let line = "resaturate a.tetdb --subdomain 1 --refine-by 0.8 --drop-fields";
    place.run_line(line).succeeds();
    assert!(fields(&place, "a.tetdb").is_empty());
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(fields(&place, "a.tetdb").len(), 7);
    place.run_line(line).succeeds();
    place.run_line("resaturate a.tetdb --forget").succeeds();
    assert!(!place.names().iter().any(|name| name.starts_with("a.tetdb/field")));
}

#[test]
fn integers_that_no_double_holds_are_left_out_of_files_of_doubles() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o a.tetdb --no-verify").succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let n = info["tets"].as_u64().expect("a number");
    let values = |from: u64| (from..from + n).flat_map(u64::to_le_bytes).collect::<Vec<u8>>();
    place.write("large.npy", npy("<i8", &format!("({n},)"), &values(1 << 53)));
    place.write("small.npy", npy("<i8", &format!("({n},)"), &values(0)));
    for name in ["large", "small"] {
        let line = format!("field a.tetdb add {name} --at tets --from {name}.npy");
        place.run_line(&line).succeeds();
    }
    for (file, is_noted) in [("a.exo", true), ("a.msh", true), ("a.xdmf", false), ("a.npy", false)]
    {
        let said = place.run_line(&format!("export a.tetdb {file}")).succeeds().stderr();
        let note = format!("note: {file} is written without large: doubles do not hold");
        assert_eq!(said.contains(&note), is_noted, "{said}");
        assert!(!said.contains("without small"), "{said}");
    }
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o a.tetdb --no-verify").succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let n = info["vertices"].as_u64().expect("a number");
    let table = |from: u64, n: u64| (from..n).map(|i| format!("{i} 1.5\n")).collect::<String>();
    place.write("few.csv", "1.5\n".repeat(n as usize - 1));
    place.write("many.csv", "1.5\n".repeat(n as usize + 1));
    place.write("twice.csv", format!("id T\n{}3 2.5\n", table(0, n - 1)));
    place.write("unknown.csv", format!("id T\n{}{} 2.5\n", table(0, n - 1), n + 7));
    place.write("word.csv", "1.5\n2.5\nhot\n");
    place.write("ragged.csv", "1,2,3\n1,2\n");
    place.write("two.csv", "1,2\n1,2\n");
    place.write("half.npy", npy("<f8", "(4,)", &[0; 20]));
    place.write("complex.npy", npy("<c16", "(4,)", &[0; 64]));
    place.write("flat.npy", npy("<f8", "(2, 5)", &[0; 80]));
    place.write("mesh.vtk", "x");
    place.write("part.csv", "0.5\n".repeat(n as usize));
    for (name, from, code, found) in [
        ("T", "few.csv", "bad-field", "no value for vertex number"),
        ("T", "many.csv", "bad-field", "no vertex number"),
        ("T", "twice.csv --ids export", "bad-field", "vertex number 3 has a second value"),
        ("T", "unknown.csv --ids export", "bad-field", "no value for vertex number"),
        ("T", "word.csv", "unexpected-text", "line 3"),
        ("T", "ragged.csv", "unexpected-text", "line 2"),
        ("T", "two.csv", "unexpected-text", "1, 3, 6 or 9"),
        ("T", "half.npy", "truncated-file", "byte"),
        ("T", "complex.npy", "unexpected-text", "c16"),
        ("T", "flat.npy", "unexpected-text", "(2, 5)"),
        ("T", "missing.npy", "unreadable-file", "missing.npy"),
        ("T", "mesh.vtk", "unknown-format", "format"),
        ("T", "part.csv --type i32", "bad-field", "0.5 is no number of type i32"),
        ("T", "part.csv --components 3", "bad-field", "expected 3"),
        ("T", "1+*x", "bad-expression", "character 3"),
        ("T", "quality", "bad-expression", "no variable"),
        ("T", "x>1", "bad-expression", "truth"),
        ("quality", "x", "bad-field", "quality"),
        ("x", "x", "bad-field", "x is a column"),
        ("a-b", "x", "bad-field", "no name"),
    ] {
        let line = format!("field a.tetdb add {name} --at vertices --from {from} --json");
        let refused = place.run_line(&line);
        let error = refused.error();
        assert_eq!(error["code"], code, "{line}: {error}");
        let text = format!("{} {}", error["message"], error["where"]);
        assert!(text.contains(found), "{line}: {error}");
        assert!(!error["help"].as_str().unwrap_or_default().is_empty() || code == "bad-field");
    }
    place.run_line("field a.tetdb add T --at vertices --from x").succeeds();
    let again = place.run_line("field a.tetdb add T --at tets --from x --json");
    assert_eq!(again.error()["code"], "bad-field");
    let none = place.run_line("field a.tetdb drop U --json");
    assert_eq!((none.exit(), &none.error()["code"]), (Some(3), &"no-such-part".into()));
    let left = place.names().iter().filter(|name| name.contains("field-")).count();
    assert_eq!(left, 1);
}

/// Any flipped byte in the file of a field is found, and most are named by field, sub-domain and chunk.
#[test]
fn damage_is_named() {
    let place = Place::new();
    two(&place);
    place.run_line("field a.tetdb add T --at vertices --from x*y").succeeds();
    let name = place.names().into_iter().find(|name| name.contains("/field-00001"));
    let path = place.path(&name.expect("it is there"));
    let good = std::fs::read(&path).expect("it can be read");
    let (mut n_found, mut n_named) = (0, 0);
    for at in (4100..good.len()).step_by(good.len() / 24) {
        let mut bad = good.clone();
        bad[at] ^= 4;
        std::fs::write(&path, &bad).expect("it can be written");
        let done = place.run_line("verify a.tetdb");
        match done.exit() {
            // Bytes of no page.
            Some(0) => {}
            exit => {
                assert_eq!(exit, Some(4), "{}", done.stderr());
                n_found += 1;
                let text = done.stderr();
                n_named += usize::from(text.contains("sub-domain 1, field T, chunk"));
            }
        }
    }
    assert!(n_found > 4 && n_named > 2, "{n_found} found, {n_named} named");
    std::fs::remove_file(&path).expect("it can be removed");
    let done = place.run_line("verify a.tetdb");
    assert!(done.exit() == Some(4) && done.stderr().contains("field T"), "{}", done.stderr());
}

/// A killed `add` or `drop` leaves the store with the field or without it, and nothing else behind.
#[test]
fn kills_leave_the_old_or_the_new() {
    let place = Place::new();
    two(&place);
    let clock = std::time::Instant::now();
    place.run_line("field a.tetdb add T --at vertices --from x+y,y,z").succeeds();
    let whole = clock.elapsed();
    let expected = digest(&place, "T");
    let (mut is_there, mut n_killed) = (true, 0);
    for i in 0..50 {
        let words: &[&str] = match is_there {
            true => &["field", "a.tetdb", "drop", "T"],
            false => &["field", "a.tetdb", "add", "T", "--at", "vertices", "--from", "x+y,y,z"],
        };
        let mut child = place.command(words).spawn().expect("the program starts");
        std::thread::sleep(whole * (i * 7 % 50) / 45);
        child.kill().expect("it can be killed");
        n_killed += usize::from(!child.wait().expect("it ends").success());
        let now = fields(&place, "a.tetdb");
        is_there = match &now[..] {
            [] => false,
            [field] => {
                assert_eq!(field["digest"].to_string(), expected);
                true
            }
            more => panic!("{more:?}"),
        };
    }
    assert!(n_killed > 10, "{n_killed}");
    if is_there {
        place.run_line("field a.tetdb drop T").succeeds();
    }
    place.run_line("field a.tetdb add n --at tets --from 1").succeeds();
    let files = place.names().into_iter().filter(|name| name.contains("/field-")).count();
    assert_eq!(files, 2);
    place.run_line("verify a.tetdb").succeeds();
}

/// Conditions, columns and orders by field are those of the same numbers computed from the mesh; chunks out of range are not read.
#[test]
fn questions_name_fields() {
    let place = Place::new();
    // Kept as pages, a small mesh has many chunks.
    let mesh = "mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --seal none --no-verify";
    place.run_line(mesh).succeeds();
    for line in [
        "T --at tets --from 300+100*x",
        "big --at tets --from 9007199254740992+round(10*x) --type i64",
        "u --at vertices --from x,y,2*z",
        "hole --at vertices --from sqrt(x-0.5)",
    ] {
        place.run_line(&format!("field a.tetdb add {line}")).succeeds();
    }
    let ask = |condition: &str, more: &str| {
        let words = ["query", "a.tetdb", "--where", condition, "--select", "id", "--csv"];
        let more: Vec<&str> = more.split_whitespace().collect();
        let done = place.run(&[&words[..], &more[..]].concat()).succeeds();
        let read =
            done.stderr().split("read ").nth(1).and_then(|s| s.split(' ').next()?.parse().ok());
        (done.stdout(), read.unwrap_or(u64::MAX))
    };
    let all = ask("quality > 0", "").1;
    for (by_field, by_place) in [
        ("T > 390 && x > 0", "x > 0.9"),
        ("T < 305 or T > 395", "x < 0.05 or x > 0.95"),
        ("u.x > 0.9 and not (u.z < 1)", "x > 0.9 and z >= 0.5"),
        ("u.y = 17", "x > 17"),
    ] {
        let (found, read) = ask(by_field, "");
        let (expected, _) = ask(by_place, "");
        let differ = found.lines().filter(|line| !expected.contains(line)).count();
        // A mean of four products need not round as the product of the mean.
        assert!(differ <= 2, "{by_field}: {differ} of {}", found.lines().count());
        assert!(found.lines().count().abs_diff(expected.lines().count()) <= 2, "{by_field}");
        assert!(read < all, "{by_field}: {read} of {all}");
        let small = ask(by_field, "--memory 64MiB").0;
        assert_eq!(small, found, "{by_field}");
    }
    // NaN fulfills no comparison, and its negation.
    let n = |condition: &str| ask(condition, "").0.lines().count() - 1;
    assert_eq!(n("hole >= 0") + n("not (hole >= 0)"), n("quality > 0"));
    let line = "query a.tetdb --order-by T --desc --limit 5 --select id,T,big,u.z --json";
    let rows = place.run_line(line).succeeds().stdout();
    let rows: Vec<Value> =
        rows.lines().map(|row| serde_json::from_str(row).expect("an object")).collect();
    assert!(rows.windows(2).all(|two| two[0]["T"].as_f64() >= two[1]["T"].as_f64()), "{rows:?}");
    assert_eq!(rows[0]["big"].as_i64(), Some((1 << 53) + 10));
    assert!(rows.iter().all(|row| row["u.z"].as_f64() >= Some(0.0)));
    for (words, code) in [
        ("query a.tetdb --where V>1", "bad-expression"),
        ("query a.tetdb --where u>1", "bad-expression"),
        ("query a.tetdb --order-by u.w", "bad-query"),
        ("query a.tetdb --select id,u.w", "bad-query"),
        ("query a.tetdb --point 0.1,0.1,0.1 --select id,T", "bad-query"),
    ] {
        let error = place.run_line(&format!("{words} --json")).error();
        assert_eq!(error["code"], code, "{words}: {error}");
    }
}

/// Exports have the values at their places; what has none says so.
#[test]
fn exports_have_fields() {
    let place = Place::new();
    two(&place);
    for line in [
        "T --at vertices --from 300+x",
        "u --at vertices --from x,y,z --type f32",
        "mark --at tets --from round(10*x) --type i32",
    ] {
        place.run_line(&format!("field a.tetdb add {line}")).succeeds();
    }
    let done = place.run_line("export a.tetdb m.npy m.vtu m.pvtu m.vtkhdf m.su2").succeeds();
    assert!(done.stderr().contains("m.su2 is written without T, u, mark"), "{}", done.stderr());
    assert_eq!(done.stderr().matches("is written without").count(), 1, "{}", done.stderr());
    let points = doubles(&place, "m_points.npy");
    let values = doubles(&place, "m_T.npy");
    assert_eq!(values.len() * 3, points.len());
    assert!(points.chunks(3).zip(&values).all(|(p, t)| *t == 300.0 + p[0]));
    // What was exported comes back as it was.
    for (name, at) in [("T", "vertices"), ("u", "vertices"), ("mark", "tets")] {
        let again = format!("field a.tetdb add {name}_2 --at {at} --from m_{name}.npy");
        place.run_line(&again).succeeds();
        assert_eq!(digest(&place, name), digest(&place, &format!("{name}_2")));
    }
    for (file, words) in [
        ("m.vtu", &["Name=\"u\" NumberOfComponents=\"3\"", "Float32", "Name=\"mark\""][..]),
        ("m.pvtu", &["Name=\"u\" NumberOfComponents=\"3\"", "Name=\"T\"", "Name=\"mark\""]),
        ("m.vtkhdf", &["mark"]),
    ] {
        let bytes = std::fs::read(place.path(file)).expect("it was written");
        let text = String::from_utf8_lossy(&bytes);
        assert!(words.iter().all(|word| text.contains(word)), "{file}");
    }
    let split = place.run_line("export a.tetdb s.vtu --split-sheets").succeeds().stderr();
    assert!(split.contains("without T, u, T_2, u_2:"), "{split}");
    let info = place.run_line("info a.tetdb").succeeds().stdout();
    assert!(info.contains("field T: f64 at vertices"), "{info}");
    for color in ["T", "u.x", "mark"] {
        place.run_line(&format!("snapshot a.tetdb a.svg --color {color}")).succeeds();
    }
    let line = "snapshot a.tetdb a.svg --color T --where mark>=5 --json";
    let range = &place.run_line(line).succeeds().json()["quality"];
    assert!(range[0].as_f64() > Some(300.4) && range[1].as_f64() < Some(301.1), "{range}");
    for words in ["--color V", "--color u", "--surface --color T"] {
        let error = place.run_line(&format!("snapshot a.tetdb a.svg {words} --json")).error();
        assert_eq!(error["code"], "bad-query", "{words}");
    }
}

/// Nodes of a Gmsh file in text, and the rows of its values at nodes by name; tags are whole numbers.
type GmshNodes = (Vec<(u64, [f64; 3])>, Vec<(String, Vec<Vec<f64>>)>);

fn gmsh_nodes(place: &Place, file: &str) -> GmshNodes {
    let text = std::fs::read_to_string(place.path(file)).expect("it was written");
    let (mut nodes, mut values) = (Vec::new(), Vec::new());
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().map(|word| word.parse().expect("a number")).collect()
    };
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line == "$Nodes" {
            let blocks = numbers(lines.next().expect("counts"))[0] as usize;
            for _ in 0..blocks {
                let n = numbers(lines.next().expect("an entity"))[3] as usize;
                let tags: Vec<Vec<f64>> = lines.by_ref().take(n).map(numbers).collect();
                let points = lines.by_ref().take(n).map(numbers);
                let points = points.map(|p| [p[0], p[1], p[2]]);
                nodes.extend(tags.iter().map(|tag| tag[0] as u64).zip(points));
            }
        } else if line == "$NodeData" {
            let head: Vec<&str> = lines.by_ref().take(8).collect();
            let n = head[7].trim().parse().expect("a number of values");
            values.push((head[1].to_owned(), lines.by_ref().take(n).map(numbers).collect()));
        }
    }
    (nodes, values)
}

/// In exports of second order, a field has half the sum of the values at both ends in the middle of an edge.
#[test]
fn middles_of_edges_have_means() {
    let place = Place::new();
    two(&place);
    for line in [
        "T --at vertices --from 1+2*x-y",
        "s --at vertices --from x,y,z,2*x,3*y,4*z",
        "k --at vertices --from round(100*x) --type i32",
        "q --at tets --from quality",
    ] {
        place.run_line(&format!("field a.tetdb add {line}")).succeeds();
    }
    let notes = place.run_line("export a.tetdb a.msh --order 2 --ascii").succeeds().stderr();
    assert!(notes.contains("a.msh is written without k: integers"), "{notes}");
    place.run_line("export a.tetdb p.msh --order 2 --ascii --pieces").succeeds();
    for file in ["a.msh", "p_1.msh", "p_2.msh"] {
        let (nodes, values) = gmsh_nodes(&place, file);
        assert_eq!(values.len(), 2, "{file}");
        for (name, rows) in values {
            assert_eq!(rows.len(), nodes.len(), "{file}: {name}");
            let of: std::collections::HashMap<u64, &[f64]> =
                rows.iter().map(|row| (row[0] as u64, &row[1..])).collect();
            for (tag, [x, y, z]) in &nodes {
                let expected = match name.as_str() {
                    "\"T\"" => vec![1.0 + 2.0 * x - y],
                    _ => vec![*x, 2.0 * x, 4.0 * z, 2.0 * x, *y, 3.0 * y, 4.0 * z, 3.0 * y, *z],
                };
                let found = of[tag];
                let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-14;
                assert!(found.len() == expected.len(), "{file}: {name}");
                assert!(
                    found.iter().zip(&expected).all(is_near),
                    "{file}: {name} at node {tag}: {found:?}, expected {expected:?}"
                );
            }
        }
    }
}
