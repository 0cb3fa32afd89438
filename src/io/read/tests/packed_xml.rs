//! 3MF and GIFTI: XML in an archive, and arrays in XML.

use super::*;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

/// An archive of parts; those after the first are named as they are.
fn archive(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (path, text) in parts {
        zip.start_file(*path, SimpleFileOptions::default()).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The mesh of a tetrahedron, with further attributes of its triangles.
fn mesh(more: &str) -> String {
    let vertices: String = POINTS
        .iter()
        .map(|[x, y, z]| format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>\n"))
        .collect();
    let triangle =
        |[a, b, c]: &[usize; 3]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3='{c}' {more}/>");
    let triangles: String = FACES.iter().map(triangle).collect();
    format!("<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>")
}

fn model(resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<model unit=\"inch\" xmlns:p=\"x\"><metadata name=\"a\">b</metadata>\n<resources>{resources}</resources>\
         <build>{build}</build></model>"
    )
}

fn object(id: u32, name: &str) -> String {
    format!("<object id=\"{id}\" name=\"{name}\" type=\"model\">{}</object>", mesh(""))
}

fn of_model(text: &str) -> Vec<u8> {
    archive(&[("3D/3dmodel.model", text)])
}

fn notes(surface: &Surface) -> String {
    let notes: Vec<String> = surface.notes.iter().map(ToString::to_string).collect();
    notes.join("\n")
}

#[test]
fn an_object_of_an_archive_is_a_surface() {
    let text = model(&object(1, ""), "<item objectid=\"1\"/>");
    let surface = read_tetrahedron(Format::ThreeMf, of_model(&text));
    assert_eq!(surface.label_names, ["part"]);
    assert!(notes(&surface).contains("inch") && surface.notes.len() == 1);
    let rels = "<Relationships><Relationship Id=\"r\" Target=\"/other/a.model\" Type=\"http://x/3dmodel\"/></Relationships>";
    let parts =
        [("[Content_Types].xml", "<Types/>"), ("_rels/.rels", rels), ("Other/A.model", &text)];
    read_tetrahedron(Format::ThreeMf, archive(&parts));
    // Without a build all objects are read, and that is noted.
    let surface =
        read_tetrahedron(Format::ThreeMf, of_model(&model(&object(7, "&lt;a&#x62;&gt;"), "")));
    assert_eq!(surface.label_names, ["<ab>"]);
    assert!(notes(&surface).contains("no build"));
}

#[test]
fn objects_are_placed_and_named() {
    let group = "<object id=\"3\" name=\"pair\"><components>\
        <component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/><component objectid=\"2\"/></components></object>";
    let build = "<item objectid=\"3\" transform=\"2 0 0 0 2 0 0 0 2 0 5 0\"/>\
        <item objectid=\"2\" transform=\"-1 0 0 0 1 0 0 0 1 -3 0 0\"/>";
    let text = model(&[object(1, "bolt"), object(2, "bolt"), group.to_owned()].concat(), build);
    let surface = read(Format::ThreeMf, of_model(&text)).unwrap();
    assert_eq!(surface.label_names, ["bolt", "bolt~2"]);
    assert_eq!(surface.labels, [[0; 4], [1; 4], [1; 4]].concat());
    let bounds = surface.bounds();
    assert_eq!(bounds.low, Point::new(-4.0, 0.0, 0.0));
    // Scaled after the shift by 10: 20 and 2 more.
    assert_eq!(bounds.high, Point::new(22.0, 7.0, 2.0));
    // All triangles look outwards, the mirrored ones as well.
    for object in 0..3 {
        let volume = |t: u32| {
            let [a, b, c] = surface.corners(4 * object + t);
            a.dot(b.cross(c)) / 6.0
        };
        assert!((0..4).map(volume).sum::<f64>() > 0.1, "object {object}");
    }
}

#[test]
fn parts_of_the_archive_and_what_is_left_out() {
    let root = model(
        "<basematerials id=\"9\"><base name=\"red\"/></basematerials><m:colorgroup id=\"8\"/>\
         <object id=\"1\" name=\"plate\"><components><component p:path=\"/3D/Objects/a.model\" objectid=\"4\"/></components></object>\
         <object id=\"2\" type=\"support\"><mesh><vertices/><triangles/></mesh></object>",
        "<item objectid=\"1\" p:UUID=\"u\"/><item objectid=\"2\"/>",
    );
    let lattice = mesh("pid=\"9\" p1=\"0\"").replace(
        "</mesh>",
        "<b:beamlattice><b:beams><b:beam v1=\"0\" v2=\"1\"/></b:beams></b:beamlattice></mesh>",
    );
    let other = model(&format!("<object id=\"4\">{lattice}</object>{}", object(5, "spare")), "");
    let bytes = archive(&[
        ("3D/3dmodel.model", &root),
        ("3D/Objects/a.model", &other),
        ("Metadata/model_settings.config", "<config/>"),
    ]);
    let surface = read_tetrahedron(Format::ThreeMf, bytes);
    assert_eq!(surface.label_names, ["plate"]);
    let notes = notes(&surface);
    for words in [
        "inch",
        "1 object that no build places was",
        "1 object of the type support was",
        "colors and materials of triangles",
        "lattices of beams",
        "colors and materials,",
        "settings of a slicing program",
    ] {
        assert!(notes.contains(words), "{words}: {notes}");
    }
}

#[test]
fn bad_archives_are_refused_with_a_place() {
    let item = "<item objectid=\"1\"/>";
    let good = model(&object(1, ""), item);
    let nested: String = (2..200)
        .map(|k| {
            let part = format!("<component objectid=\"{}\"/>", k - 1);
            format!("<object id=\"{k}\"><components>{part}{part}</components></object>")
        })
        .collect();
    let nested = object(1, "") + &nested;
    for (text, words) in [
        (good.replace("v2=\"3\"", "v2=\"4\""), "out of range"),
        (good.replace("x=\"1\"", "x=\"nan\""), "finite number"),
        (good.replace("objectid=\"1\"", "objectid=\"2\""), "object 2"),
        (good.replace("objectid=\"1\"", "objectid=\"1\" transform=\"1 0 0\""), "twelve numbers"),
        (good.replace("</build></model>", ""), "the end of the model"),
        (good.replace("<vertex x", "<vertex <x"), ""),
        (good.replace("mesh>", "volumetric>"), "volumetric"),
        (model(&(object(1, "") + &object(1, "")), item), "number of its own"),
        (model(&nested, "<item objectid=\"24\"/>"), "more than"),
        (model(&nested, "<item objectid=\"199\"/>"), "more than"),
        (
            model(
                "<object id=\"1\"><components><component objectid=\"1\"/></components></object>",
                item,
            ),
            "more than",
        ),
        (
            model(
                "<object id=\"1\"><components><component objectid=\"1\" path=\"/b\"/></components></object>",
                item,
            ),
            "a part b",
        ),
        ("<html></html>".to_owned(), "a tag `model`"),
        (model("", ""), "no triangles"),
    ] {
        let error = read(Format::ThreeMf, of_model(&text)).expect_err(words);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    let error = read(Format::ThreeMf, archive(&[("a", "b")])).expect_err("no model");
    assert!(error.to_string().contains("3D/3dmodel.model"), "{error}");
    let bytes = of_model(&good);
    for n in 0..bytes.len() {
        assert!(read(Format::ThreeMf, &bytes[..n]).is_err(), "cut at {n}");
    }
    // Blanks that unpack to a thousand times their bytes.
    let bomb = of_model(&good.replace("<build>", &format!("<build>{}", " ".repeat(1 << 24))));
    let error = read(Format::ThreeMf, bomb).expect_err("too large");
    assert_eq!(error.code(), tetdb_schema::code::Code::Memory, "{error}");
}

/// A file with points and triangles as `encode` writes their numbers.
fn gifti(points: &str, triangles: &str, attributes: &str) -> String {
    let array = |intent: &str, kind: &str, data: &str| {
        format!(
            "<DataArray Intent=\"NIFTI_INTENT_{intent}\" DataType=\"NIFTI_TYPE_{kind}\" Dimensionality=\"2\" Dim0=\"4\" Dim1=\"3\" {attributes}>\n\
             <MetaData><MD><Name><![CDATA[a]]></Name></MD></MetaData><Data>{data}</Data></DataArray>\n"
        )
    };
    let both =
        [array("POINTSET", "FLOAT32", points), array("TRIANGLE", "INT32", triangles)].concat();
    format!(
        "<?xml version=\"1.0\"?><!DOCTYPE GIFTI>\n<GIFTI Version=\"1.0\" NumberOfDataArrays=\"2\">{both}</GIFTI>\n"
    )
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let word = |bytes: &[u8]| {
        let word =
            bytes.iter().fold(0u32, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - bytes.len()));
        let letter = |k: usize| match k <= bytes.len() {
            true => LETTERS[(word >> (18 - 6 * k) & 63) as usize] as char,
            false => '=',
        };
        (0..4).map(letter).collect::<String>()
    };
    bytes.chunks(3).map(word).collect()
}

#[test]
fn arrays_of_gifti_are_read_in_every_encoding() {
    let text =
        |rows: Vec<[f64; 3]>| rows.iter().flatten().map(|x| format!("{x}\n")).collect::<String>();
    let faces: Vec<[f64; 3]> = FACES.iter().map(|f| f.map(|v| v as f64)).collect();
    let ascii = gifti(&text(POINTS.to_vec()), &text(faces.clone()), "Encoding=\"ASCII\"");
    assert_eq!(read_tetrahedron(Format::Gifti, &ascii).label_names, ["part"]);
    let columns = |rows: &[[f64; 3]]| {
        (0..3).flat_map(|k| rows.iter().map(move |r| r[k])).collect::<Vec<f64>>()
    };
    let by_column = [columns(&POINTS), columns(&faces)]
        .map(|all| all.iter().map(|x| format!("{x} ")).collect::<String>());
    let file = gifti(
        &by_column[0],
        &by_column[1],
        "Encoding=\"ASCII\" ArrayIndexingOrder=\"ColumnMajorOrder\"",
    );
    read_tetrahedron(Format::Gifti, file);
    for is_big in [false, true] {
        let flat = POINTS.concat();
        let floats = flat
            .iter()
            .map(|&x| x as f32)
            .flat_map(|x| if is_big { x.to_be_bytes() } else { x.to_le_bytes() });
        let integers = faces.concat().into_iter().map(|x| x as i32);
        let integers =
            integers.flat_map(|x| if is_big { x.to_be_bytes() } else { x.to_le_bytes() });
        let both = [floats.collect::<Vec<u8>>(), integers.collect()];
        let order = if is_big { "Endian=\"BigEndian\"" } else { "Endian=\"LittleEndian\"" };
        let [points, triangles] = both.clone().map(|bytes| base64(&bytes));
        read_tetrahedron(
            Format::Gifti,
            gifti(&points, &triangles, &format!("Encoding=\"Base64Binary\" {order}")),
        );
        let [points, triangles] = both.map(|bytes| {
            let mut packed =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            packed.write_all(&bytes).unwrap();
            base64(&packed.finish().unwrap())
        });
        let file = gifti(&points, &triangles, &format!("Encoding=\"GZipBase64Binary\" {order}"));
        read_tetrahedron(Format::Gifti, &file);
        // Longer than declared: a bomb ends there.
        let error =
            read(Format::Gifti, file.replace("Dim0=\"4\"", "Dim0=\"3\"")).expect_err("too long");
        assert!(error.to_string().contains("3 rows of three"), "{error}");
    }
    let values = "<DataArray Intent=\"NIFTI_INTENT_SHAPE\" Dim0=\"4\"><Data>1 2 3 4</Data></DataArray></GIFTI>";
    let moved = "<MatrixData>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</MatrixData><MetaData>";
    let surface = read_tetrahedron(
        Format::Gifti,
        ascii.replace("</GIFTI>", values).replace("<MetaData>", moved),
    );
    let notes = notes(&surface);
    assert!(
        notes.contains("1 array of values at vertices was") && notes.contains("was not applied"),
        "{notes}"
    );
    for (file, words) in [
        (ascii.replace("ASCII", "ExternalFileBinary"), "ExternalFileBinary"),
        (ascii.replace("Dim1=\"3\"", "Dim1=\"4\""), "not three columns"),
        (ascii.replace("FLOAT32", "RGB24"), "RGB24"),
        (ascii.replace("Dim0=\"4\"", "Dim0=\"5\""), "5 rows of three"),
        (ascii.replace("Dim0=\"4\"", "Dim0=\"4000000000\""), "bytes of memory"),
        (ascii.replace("<Data>", "<Dta>"), "no tag `Data`"),
        (ascii.replace("3\n", "7\n"), "out of range"),
        (ascii.replace("3\n", "-1\n"), "out of range"),
        (ascii.replace("</GIFTI>", ""), "ends too early"),
        (ascii.replace("GIFTI", "GIFT"), "a tag `GIFTI`"),
    ] {
        let error = read(Format::Gifti, file).expect_err(words);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}
