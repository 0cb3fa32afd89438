//! Questions with numbers, conditions and orders, and the number of chunks that they read.

use super::*;

/// Hits without the values that are read only on request.
fn bare(hits: &[Hit]) -> Vec<Hit> {
    let without = |hit: &Hit| Hit { on_surface: None, ..*hit };
    hits.iter().map(without).collect()
}

#[test]
fn numbers_and_conditions_select_what_they_say() -> Outcome {
    for fixture in [grid(6, 3)?, real()?] {
        let all = fixture.all()?;
        let mut session = fixture.session(64 << 20)?;
        let none = Selection::default;
        expect(&mut session, &all, none(), |_| true)?;
        let selection = Selection { subdomains: Some(vec![1]), ..none() };
        let n = expect(&mut session, &all, selection, |t| t.id.subdomain().rank() == 1)?;
        assert!(n > 0);
        let last = all.iter().map(|t| t.region).max().unwrap_or_default();
        let selection = Selection { regions: Some(vec![last]), ..none() };
        expect(&mut session, &all, selection, |t| t.region == last)?;
        // Only the mesh of a surface has its regions on record.
        if !session.store.regions()?.is_empty() {
            let selection = Selection { regions: Some(vec![last, 7]), ..none() };
            let refused = session.select(selection).err();
            assert!(matches!(refused, Some(QueryError::NoRegion { .. })), "{refused:?}");
        }
        for text in [
            "quality > 1.5 and region = 1",
            "x < 0.25 or z > 0.75 and subdomain in [1]",
            "edge_max > 0.07 and angle_min < 40",
            "volume*6 < edge_min^3",
            "quality > 1e6",
            "excess > 1.2 and quality < 3",
        ] {
            let condition = Expression::parse(text, &VARIABLES)?;
            let selection = Selection { condition: Some(condition.clone()), ..none() };
            expect(&mut session, &all, selection, |t| condition.truth(&t.values()))?;
        }
        let three = [all[0].id, all[all.len() / 2].id, all[all.len() - 1].id];
        let selection = Selection { tets: Some(three.to_vec()), ..none() };
        expect(&mut session, &all, selection, |t| three.contains(&t.id))?;
        assert_eq!(session.tet(three[1])?, bare(&all)[all.len() / 2]);
    }
    Ok(())
}

#[test]
fn answers_are_sorted_by_any_variable() -> Outcome {
    let fixture = grid(6, 2)?;
    let mut all = fixture.all()?;
    let mut session = fixture.session(64 << 20)?;
    for (variable, descending) in [(4, false), (4, true), (0, true), (3, false)] {
        let dir = fixture.dir.path();
        // With little memory, sorted runs go to the disk.
        let ordered = Ordered::new(
            session.select(Selection::default())?,
            variable,
            descending,
            dir,
            1 << 16,
        )?;
        let found: Vec<Hit> = ordered.collect::<Result<_, _>>()?;
        all.sort_by(|a, b| {
            let (x, y) = (a.values()[variable], b.values()[variable]);
            let by_value = x.total_cmp(&y);
            let by_value = if descending { by_value.reverse() } else { by_value };
            by_value.then(a.id.cmp(&b.id))
        });
        assert_eq!(bare(&found), bare(&all));
    }
    Ok(())
}

#[test]
fn the_worst_and_the_best_are_found_without_a_look_at_all() -> Outcome {
    for fixture in [grid(6, 2)?, real()?] {
        let all = fixture.all()?;
        for (text, greatest, limit) in [
            ("true", true, 7),
            ("true", false, 1),
            ("x > 0.3", true, 100),
            ("quality < 1.3", true, 5),
            ("x > 99", true, 5),
            ("true", true, 0),
            ("y > 0.5", false, 1_000_000),
        ] {
            let condition = Expression::parse(text, &VARIABLES)?;
            let mut expected: Vec<Hit> =
                all.iter().copied().filter(|t| condition.truth(&t.values())).collect();
            let key = |t: &Hit| {
                if greatest { -t.shape.quality } else { t.shape.quality }
            };
            expected.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.id.cmp(&b.id)));
            expected.truncate(limit);
            let selection = Selection { condition: Some(condition), ..Selection::default() };
            let mut session = fixture.session(64 << 20)?;
            let found = session.extreme(&selection, greatest, limit)?;
            assert_eq!(bare(&found), bare(&expected), "{text}");
            // A single one is found in the chunk that promises most, but for a promise hardly kept.
            let measures = session.measures();
            assert!(limit > 1 || measures.tet_chunks_read <= 2, "{text}: {measures:?}");
        }
    }
    Ok(())
}

#[test]
fn only_chunks_that_matter_are_read() -> Outcome {
    let fixture = real_of("box,h=0.035")?;
    let all = fixture.all()?;
    let mut session = fixture.session(64 << 20)?;
    let chunks = session.measures();
    assert!(chunks.tet_chunks >= 4, "{chunks:?}");
    let nowhere = Selection {
        solids: vec![Solid::Sphere { center: Point::splat(-9.0), radius: 1.0 }],
        ..Selection::default()
    };
    assert_eq!(session.select(nowhere)?.count(), 0);
    let never = Selection {
        condition: Some(Expression::parse("quality > 1e6 or x > 17", &VARIABLES)?),
        ..Selection::default()
    };
    assert_eq!(session.select(never)?.count(), 0);
    session.locate(&[Point::splat(-1.0)])?;
    assert_eq!(session.measures().tet_chunks_read, 0);
    let center = all[all.len() / 3].centroid();
    session.locate(&[center])?;
    let read = session.measures();
    assert!(read.tet_chunks_read < chunks.tet_chunks / 2, "{read:?}");
    assert!(read.vertex_chunks_read < chunks.vertex_chunks / 2, "{read:?}");
    Ok(())
}

#[test]
fn whole_chunks_have_no_other_tetrahedra() -> Outcome {
    let fixture = real_of("box,h=0.035")?;
    let mut session = fixture.session(64 << 20)?;
    let (mut n_whole, mut n_part) = (0, 0);
    for text in ["x < 0.5", "quality < 2", "region = 1 and subdomain = 0", "angle_min > 0", "true"]
    {
        let condition = Some(Expression::parse(text, &VARIABLES)?);
        let selection = Selection { condition, ..Selection::default() };
        let chunks = session.chunks(&selection)?;
        let n_expected = session.select(selection.clone())?.count();
        let mut of_chunks = ChunkedSelection::new(&mut session, selection.clone())?;
        let mut n = 0;
        for TetChunk { subdomain, chunk, n_tets, is_whole } in chunks {
            let hits = of_chunks.hits(&mut session, subdomain, chunk)?.len();
            assert!(!is_whole || hits == n_tets as usize, "{text}: {hits} of {n_tets}");
            *(if is_whole { &mut n_whole } else { &mut n_part }) += 1;
            n += hits;
        }
        assert_eq!(n, n_expected, "{text}");
        let near = vec![Solid::Sphere { center: Point::splat(0.5), radius: 9.0 }];
        let chunks = session.chunks(&Selection { solids: near, ..selection })?;
        assert!(
            chunks.iter().all(|chunk| !chunk.is_whole),
            "places are never known from summaries"
        );
    }
    assert!(n_whole > 0 && n_part > 0, "{n_whole} whole, {n_part} in part");
    Ok(())
}
