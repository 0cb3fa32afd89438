//! VTK's files of polygons and cells, legacy and XML.

use super::*;

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word =
            three.iter().fold(0u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - three.len()));
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k) & 63) as usize] as char;
            text.push(if k <= three.len() { letter } else { '=' });
        }
    }
    text
}

fn points() -> String {
    POINTS.map(|p| p.map(|x| x.to_string()).join(" ")).join("\n")
}

#[test]
fn legacy_polygons_and_cells() {
    let head = |kind: &str| {
        format!(
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET {kind}\nPOINTS 4 double\n{}\n",
            points()
        )
    };
    let faces: String = FACES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
    read_tetrahedron(Format::Vtk, head("POLYDATA") + "POLYGONS 4 16\n" + &faces);
    let cells = format!("CELLS 6 24\n{faces}2 0 1\n4 0 1 2 3\nCELL_TYPES 6\n5 5 7 5 3 10\n");
    let surface = read_tetrahedron(Format::Vtk, head("UNSTRUCTURED_GRID") + &cells);
    assert_eq!(surface.notes.len(), 2);
    // A strip runs one way, and a pixel in rows.
    let strip = head("POLYDATA") + "TRIANGLE_STRIPS 1 7\n6 0 1 2 3 0 1\n";
    let surface = read(Format::Vtk, strip).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 0], [0, 3, 1]]);
    let mut binary =
        b"# vtk DataFile Version 2.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n".to_vec();
    POINTS.as_flattened().iter().for_each(|&x| binary.extend((x as f32).to_be_bytes()));
    binary.extend(b"\nPOLYGONS 4 16\n");
    for face in FACES {
        [3, face[0], face[1], face[2]]
            .iter()
            .for_each(|&v| binary.extend((v as i32).to_be_bytes()));
    }
    read_tetrahedron(Format::Vtk, &binary);
    for (from, to, code) in [
        ("3 0 3 2", "3 0 4 2", "index-out-of-range"),
        ("POLYDATA", "STRUCTURED_POINTS", "unexpected-text"),
        ("4 16", "4 15", "count-mismatch"),
        ("3 0 2 1\n", "", "truncated-file"),
    ] {
        let text = (head("POLYDATA") + "POLYGONS 4 16\n" + &faces).replacen(from, to, 1);
        assert_eq!(refuse(Format::Vtk, text).0, code, "{from}");
    }
}

/// A tetrahedron as `.vtp` in a format of its arrays.
fn vtp(format: &str) -> Vec<u8> {
    let floats = POINTS.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let corners =
        FACES.as_flattened().iter().flat_map(|&v| (v as i32).to_le_bytes()).collect::<Vec<u8>>();
    let ends = [3i64, 6, 9, 12].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let is_packed = format.starts_with("packed");
    let block = |bytes: &[u8]| -> [Vec<u8>; 2] {
        if !is_packed {
            return [(bytes.len() as u32).to_le_bytes().to_vec(), bytes.to_vec()];
        }
        use std::io::Write;
        let mut pack = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        pack.write_all(bytes).unwrap();
        let packed = pack.finish().unwrap();
        let head = [1, bytes.len() as u32, 0, packed.len() as u32];
        [head.iter().flat_map(|n| n.to_le_bytes()).collect(), packed]
    };
    let mut appended = Vec::new();
    let mut array = |name: &str, kind: &str, text: String, bytes: &[u8]| {
        let tag =
            format!("<DataArray type=\"{kind}\" Name='{name}' NumberOfComponents=\"1\" format=");
        let [head, data] = block(bytes);
        match format {
            "ascii" => format!("{tag}\"ascii\">\n{text}</DataArray>\n"),
            "joined" => {
                format!("{tag}\"binary\">\n {} </DataArray>", base64(&[head, data].concat()))
            }
            "parts" | "packed" => {
                format!("{tag}\"binary\">{}{}</DataArray>", base64(&head), base64(&data))
            }
            _ => {
                let offset = appended.len();
                match format.contains("base64") {
                    true => appended.extend((base64(&head) + &base64(&data)).bytes()),
                    false => appended.extend([head, data].concat()),
                }
                format!("{tag}\"appended\" offset=\"{offset}\"/>\n")
            }
        }
    };
    let compressor = if is_packed { "compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let corners_text = FACES.as_flattened().iter().map(|v| v.to_string() + " ").collect();
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!-- by > hand -->\n<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" {compressor}>\n<PolyData>\n\
         <Piece NumberOfPoints=\"4\" NumberOfPolys=\"4\">\n<Points>{}</Points>\n<Polys>{}{}</Polys>\n</Piece></PolyData>\n",
        array("", "Float64", points(), &floats),
        array("connectivity", "Int32", corners_text, &corners),
        array("offsets", "Int64", "3 6 9 12".to_owned(), &ends)
    )
    .into_bytes();
    if !appended.is_empty() {
        let encoding = if format.contains("base64") { "base64" } else { "raw" };
        text.extend(format!("<AppendedData encoding=\"{encoding}\">\n _").bytes());
        text.extend(appended);
        text.extend(b"\n</AppendedData>");
    }
    text.extend(b"</VTKFile>\n");
    text
}

#[test]
fn xml_in_every_encoding() {
    for format in
        ["ascii", "joined", "parts", "packed", "raw", "base64", "packed raw", "packed base64"]
    {
        let file = vtp(format);
        read_tetrahedron(Format::VtkXml, &file);
        for n in 0..file.len() {
            let _ = read(Format::VtkXml, &file[..n]);
            let mut changed = file.clone();
            changed[n] = b'9';
            let _ = read(Format::VtkXml, &changed);
        }
    }
    let text = String::from_utf8(vtp("ascii")).unwrap();
    for (from, to, code) in [
        ("3 6 9 12", "3 6 9 13", "count-mismatch"),
        ("1 2 3 0", "1 2 4 0", "index-out-of-range"),
        ("PolyData\"", "ImageData\"", "unsupported-content"),
        ("3 6 9 12", "", "count-mismatch"),
        ("VTKFile type", "svg type", "unexpected-text"),
        ("3 6 9 12", "3 six 9 12", "unexpected-text"),
    ] {
        assert_eq!(refuse(Format::VtkXml, text.replacen(from, to, 1)).0, code, "{from} {to}");
    }
}
