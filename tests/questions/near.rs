//! Questions about the surface, interfaces and neighbors.

use super::*;

#[test]
fn surface_and_interfaces_select_what_stands_on_them() -> Outcome {
    let (cells, parts) = (6, 3);
    let fixture = grid(cells, parts)?;
    let all = fixture.all()?;
    let mut session = fixture.session(64 << 20)?;
    let faces =
        |t: &Hit, on: &dyn Fn(&Point) -> bool| t.corners.iter().filter(|c| on(c)).count() == 3;
    let end = cells as f64;
    let outer = |c: &Point| c.min_element() == 0.0 || c.max_element() == end;
    let selection = Selection { touching_surface: true, ..Selection::default() };
    expect(&mut session, &all, selection, |t| t.corners.iter().any(outer))?;
    // Label 0 is the side x = 0, label 5 the side z = end.
    let sides = |t: &Hit| faces(t, &|c| c.x == 0.0) || faces(t, &|c| c.z == end);
    let selection = Selection { labels: Some(vec![0, 5]), ..Selection::default() };
    let n = expect(&mut session, &all, selection.clone(), sides)?;
    // In each cell along the edge, one tetrahedron has both.
    assert_eq!(n, 2 * 2 * cells * cells - cells);
    let cut = 4.0;
    let interface = |t: &Hit| faces(t, &|c| c.x == cut);
    let both = Selection { interface: Some([2, 1]), ..Selection::default() };
    let n = expect(&mut session, &all, both.clone(), interface)?;
    assert_eq!(n, 2 * 2 * cells * cells);
    let selection = Selection { labels: selection.labels, ..both };
    // Rows of cells under the side z = end have at most one face on each.
    expect(&mut session, &all, selection, |t| interface(t) && sides(t))?;
    let selection = Selection { interface: Some([0, 2]), ..Selection::default() };
    let refused = session.select(selection).err();
    assert!(matches!(refused, Some(QueryError::NoInterface(0, 2))));
    let selection = Selection { subdomains: Some(vec![3]), ..Selection::default() };
    assert!(session.select(selection).is_err());
    Ok(())
}

#[test]
fn balls_shells_and_neighbors_cross_interfaces() -> Outcome {
    let mut random = Random::new(4);
    for fixture in [grid(4, 2)?, real()?] {
        let all = fixture.all()?;
        let mut session = fixture.session(64 << 20)?;
        let mut across = 0;
        for _ in 0..40 {
            let tet = all[random.below(all.len())];
            let [a, b, ..] = tet.vertices;
            let id = |n: u64| VertexId::from_number(n).expect("it came from a store");
            for vertices in [vec![a], vec![a, b]] {
                let named: Vec<VertexId> = vertices.iter().map(|&v| id(v)).collect();
                let selection =
                    Selection { sharing: Some(session.around(&named)?), ..Selection::default() };
                expect(&mut session, &all, selection, |t| {
                    vertices.iter().all(|v| t.vertices.contains(v))
                })?;
            }
            let selection =
                Selection { sharing: Some(session.next_to(tet.id)?), ..Selection::default() };
            let shared = |t: &Hit| t.vertices.iter().filter(|v| tet.vertices.contains(v)).count();
            let n = expect(&mut session, &all, selection.clone(), |t| shared(t) == 3)?;
            assert!((1..=4).contains(&n));
            let others = ids(session.select(selection)?)?;
            across += others.iter().filter(|o| o.subdomain() != tet.id.subdomain()).count();
        }
        assert!(across > 0 || all.len() > 1000, "no neighbor across the interface");
        let nobody: TetId = "0:536870911".parse()?;
        assert!(matches!(session.next_to(nobody), Err(QueryError::NoTet { .. })));
        let nowhere = VertexId::from_number(7 << 32).expect("cut 7");
        let refused = session.around(&[nowhere]);
        assert!(matches!(refused, Err(QueryError::NoVertex { .. })));
    }
    Ok(())
}
