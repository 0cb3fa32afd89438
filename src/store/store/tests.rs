//! A store written by hand of two sub-domains with an interface; opening, stepping, purging, damage.

use super::*;
use crate::sealed::Shape;
use tetdb_schema::blob::Blob;

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn job() -> Job {
    Job { options: "{}".to_owned(), tool_version: "0".to_owned(), ..Job::default() }
}

fn no_error<T>(result: Result<T, StoreError>) -> StoreError {
    match result {
        Ok(_) => panic!("an error was expected"),
        Err(e) => e,
    }
}

#[test]
fn what_is_in_the_way_of_a_new_store_is_named() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("a.tetdb");
    let mut catalog = Catalog::create(&path, &job())?;
    assert!(matches!(no_error(Catalog::open(&path)), StoreError::Busy { .. }));
    assert!(matches!(no_error(Catalog::create(&path, &job())), StoreError::Busy { .. }));
    assert_eq!(catalog.state()?, StoreState::New);
    catalog.close()?;
    let found = no_error(Catalog::create(&path, &job()));
    assert!(matches!(found, StoreError::Unfinished { .. }), "{found}");
    let mut catalog = Catalog::open_writable(&path)?;
    catalog.commit(|step| {
        step.set_state(StoreState::Sealed);
        Ok(())
    })?;
    drop(catalog);
    let found = no_error(Catalog::create(&path, &job()));
    assert!(matches!(found, StoreError::Finished { .. }), "{found}");
    let writer = Catalog::open_writable(&path)?;
    assert!(matches!(no_error(Catalog::open_writable(&path)), StoreError::Busy { .. }));
    drop((Catalog::open(&path)?, Catalog::open(&path)?, writer));
    let found = no_error(Catalog::create(dir.path(), &job()));
    assert!(matches!(found, StoreError::NotOurs { .. }), "{found}");
    let found = no_error(Catalog::open(dir.path().join("b")));
    assert!(matches!(found, StoreError::NotFound { .. }), "{found}");
    std::fs::create_dir(dir.path().join("empty"))?;
    Catalog::create(dir.path().join("empty"), &job())?.close()?;
    Ok(())
}

#[test]
fn a_step_flips_rows_and_forgets_files_together() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("a.tetdb");
    let mut catalog = Catalog::create(&path, &job())?;
    let (old, new) = (catalog.file_path(3, 1), catalog.file_path(3, 2));
    std::fs::write(old.path(), b"old")?;
    catalog.commit(|step| {
        step.list_file(3, 1);
        step.set_blob(Blob::SizeField, &vec![7; 200_000]);
        Ok(())
    })?;
    std::fs::write(new.path(), b"new")?;
    let journal = JournalRow {
        state: StoreState::Coarse,
        subdomain: Some(3),
        step: "saturate".to_owned(),
        seconds: 1.5,
        measures: vec![],
    };
    catalog.commit(|step| {
        step.list_file(3, 2);
        step.unlist_file(3, 1);
        step.append_journal(&journal);
        step.append_journal(&journal);
        step.set_blob(Blob::SizeField, &[7; 100_000]);
        Ok(())
    })?;
    assert!(!old.exists() && new.exists());
    // A catalog whose writer was killed opens for reading as it stood.
    let killed = dir.path().join("killed.tetdb");
    std::fs::create_dir(&killed)?;
    std::fs::copy(path.join("catalog.redb"), killed.join("catalog.redb"))?;
    assert_eq!(Catalog::open(&killed)?.journal()?.len(), 2);
    // Killed between writing a file and listing it.
    let torn = catalog.file_path(4, 1);
    std::fs::write(torn.path(), b"torn")?;
    std::fs::write(path.join("notes.txt"), b"mine")?;
    catalog.scratch_dir()?;
    drop(catalog);
    let mut catalog = Catalog::open_writable(&path)?;
    assert!(!torn.exists() && new.exists() && path.join("notes.txt").exists());
    assert_eq!(catalog.files()?, [FileRow { subdomain: 3, generation: 2 }]);
    assert_eq!(catalog.journal()?, [journal.clone(), journal]);
    assert_eq!(catalog.blob(Blob::SizeField)?, Some(vec![7; 100_000]));
    assert_eq!(catalog.blob(Blob::Recipe)?, None);
    assert!(
        no_error(catalog.commit(|step| {
            step.list_file(9, 9);
            Ok(())
        }))
        .to_string()
        .contains("subdomain-00009-g9")
    );
    Ok(())
}

#[test]
fn a_store_of_two_subdomains_reads_back() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let mut store = Catalog::open(&path)?;
    let mut other = Catalog::open(&path)?;
    assert_eq!(store.digest()?, other.digest()?);
    assert!(matches!(no_error(store.subdomain(2)), StoreError::NoSubdomain { .. }));
    let mut volume = 0.0;
    for rank in 0..2 {
        let mut part = store.open_subdomain(rank, 1 << 20)?;
        let tets = part.tets().collect::<Result<Vec<_>, _>>()?;
        assert_eq!(tets.len(), 1);
        assert_eq!(tets[0].0.to_string(), format!("{rank}:0"));
        assert_eq!(part.vertices().count(), 4);
        assert_eq!(part.facets().count(), 3);
        let face = part.interfaces().next().ok_or("an interface face")??;
        assert_eq!((face.cut, face.other), (1, 1 - rank));
        let corners = part.corners(tets[0].1.nodes)?;
        volume += Shape::new(corners.map(|c| c.point)).volume;
        assert!(part.corner(4).is_err());
        assert!(part.row().bytes < 200_000, "{}", part.row().bytes);
    }
    assert!((volume - 0.5).abs() < 1e-12);
    Ok(())
}

#[test]
fn a_row_that_counts_more_than_there_can_be_is_damage() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let mut store = Catalog::open_writable(&path)?;
    let mut row = store.subdomain(1)?;
    row.facets = u64::MAX;
    std::fs::write(path.join("coarse-00001-g1.redb"), [])?;
    let kept = CoarseRow {
        rank: 1,
        generation: 1,
        tets: u64::from(u32::MAX),
        vertices: u64::MAX,
        facets: 0,
        interface_faces: 0,
        chunks: [0; 4],
        bytes: 0,
    };
    store.commit(|step| {
        step.set_subdomain(&row);
        step.list_coarse(&kept);
        Ok(())
    })?;
    let found = [
        no_error(store.subdomain(1)),
        no_error(store.subdomains()),
        no_error(store.coarse_snapshot(1)),
        no_error(store.coarse_snapshots()),
    ];
    for error in found {
        assert!(error.is_damage(), "{error}");
        assert!(error.to_string().contains("counts more"), "{error}");
    }
    Ok(())
}

#[test]
fn a_damaged_file_is_an_error_that_names_the_place() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let file = path.join("subdomain-00001-g1.redb");
    let bytes = std::fs::read(&file)?;
    let read = || -> Result<(), StoreError> {
        let mut part = Catalog::open(&path)?.open_subdomain(1, 1 << 20)?;
        part.tets().try_for_each(|t| t.map(drop))?;
        part.vertices().try_for_each(|t| t.map(drop))?;
        part.facets().try_for_each(|t| t.map(drop))?;
        Ok(part.interfaces().try_for_each(|t| t.map(drop))?)
    };
    read()?;
    let mut found = 0;
    for place in (0..bytes.len()).step_by(bytes.len() / 300) {
        let mut torn = bytes.clone();
        torn[place] ^= 0x10;
        std::fs::write(&file, &torn)?;
        found += usize::from(read().is_err());
    }
    // The payloads of all chunks, found by their magic: the file also holds copies that no longer count.
    let mut torn = bytes.clone();
    for at in 0..bytes.len() - 50 {
        if bytes[at..].starts_with(b"TETC") {
            torn[at + 42] ^= 1;
        }
    }
    std::fs::write(&file, &torn)?;
    let error = no_error(read());
    assert!(error.is_damage());
    assert!(error.to_string().contains("sub-domain 1"), "{error}");
    assert!(found > 0);
    std::fs::remove_file(&file)?;
    assert!(no_error(read()).is_damage());
    Ok(())
}

/// A field at vertices and one at tetrahedra: values, ranges, a flipped bit, a file that is not listed.
#[test]
fn fields_are_kept_beside_the_mesh() -> Outcome {
    use crate::audit::damage;
    use crate::sealed::FieldWriter;
    use tetdb_schema::field::{FieldNumber, FieldPlace, FieldRow, Scalar};
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("a.tetdb");
    two_subdomains(&path)?;
    let mut catalog = Catalog::open_writable(&path)?;
    let field = |id, name: &str, place, number, components| FieldRow {
        id,
        name: name.to_owned(),
        place,
        number,
        components,
    };
    let fields = [
        field(1, "u", FieldPlace::Vertices, FieldNumber::F64, 3),
        field(2, "n", FieldPlace::Tets, FieldNumber::I32, 1),
    ];
    let mut parts = Vec::new();
    for field in &fields {
        for row in catalog.subdomains()? {
            let mut mesh = catalog.open_row(row.clone(), 4 << 20)?;
            let file = FileRow { subdomain: row.rank, generation: field.id };
            let path = catalog.field_path(file);
            let mut writer = FieldWriter::create(path, field, &mesh, field.id, 4 << 20)?;
            let values: Vec<f64> = match field.place {
                FieldPlace::Tets => vec![-7.0],
                FieldPlace::Vertices => (0..12).map(|i| f64::from(i) * 0.5).collect(),
            };
            let word = |x: &f64| field.number.pack(Scalar::Float(*x)).expect("it fits");
            writer.push(&values.iter().map(word).collect::<Vec<_>>())?;
            parts.push(writer.finish(&mut mesh)?);
        }
    }
    catalog.commit(|step| {
        fields.iter().for_each(|field| step.set_field(field));
        parts.iter().for_each(|part| step.set_field_part(part));
        Ok(())
    })?;
    std::fs::write(path.join("field-00000-g9.redb"), b"stray")?;
    drop(catalog);
    drop(Catalog::open_writable(&path)?);
    assert!(!path.join("field-00000-g9.redb").exists());
    let mut catalog = Catalog::open(&path)?;
    assert_eq!((catalog.fields()?, catalog.field_parts()?), (fields.to_vec(), parts.clone()));
    assert_eq!(parts[0].ranges[1].high, 5.0);
    let mesh = catalog.open_subdomain(1, 4 << 20)?;
    let mut u = catalog.open_field(&fields[0], &mesh, 1 << 20)?;
    assert_eq!(f64::from_bits(u.word(2, 1)?), 3.5);
    assert_eq!(u.chunk(0)?.len(), 12);
    assert_eq!(u.range_over(0, 2), ([1.0, 5.5], false));
    assert!(u.word(4, 0).is_err());
    assert!(damage(&mut catalog)?.is_empty());
    // A file at the place of another one is damage, and so is a flipped bit; both name the field.
    let [own, other] = [0, 1].map(|rank| path.join(format!("field-0000{rank}-g2.redb")));
    let good = std::fs::read(&own)?;
    std::fs::copy(&other, &own)?;
    let found = damage(&mut catalog)?;
    assert!(found.len() == 1 && found[0].to_string().contains("field n, chunk 0"), "{found:?}");
    std::fs::write(&own, &good)?;
    assert!(damage(&mut catalog)?.is_empty());
    Ok(())
}
