use super::*;
use crate::ids::{Owner, SubdomainId, VertexId};
use crate::page::{
    NONE, PageAddress, PageError, PageKind, SLOTS, open_page, seal_full_page, stored_bytes, u32_le,
};
use crate::record::{InterfaceFace, SealedFacet, SealedTet, SealedVertex, tag};

const RANK: u32 = 3;
const GENERATION: u32 = 9;

/// Writes records to pages and reads them back.
fn through<R: PageRecord>(records: &[R], working: impl Fn(R) -> WorkingWords) -> Vec<R> {
    let mut packer = PagePacker::new(RANK, GENERATION);
    let mut values = std::collections::BTreeMap::new();
    for &record in records {
        if let Some(set) = packer.push(record, working(record)) {
            assert_eq!(set.records.len(), 2046);
            values.extend(set.values);
        }
    }
    values.extend(packer.cut().into_iter().flat_map(|set| set.values));
    assert!(packer.cut().is_none());
    assert_eq!(packer.count(), records.len() as u64);
    let mut decoder = PageDecoder::new(RANK, GENERATION);
    let mut elsewhere = PageDecoder::new(RANK + 1, GENERATION);
    let mut later = PageDecoder::new(RANK, GENERATION + 1);
    let (mut all, mut page_records) = (Vec::new(), Vec::new());
    for page in 0..packer.pages() {
        let (main, extra) = PageDecoder::keys::<R>(page);
        decoder.open::<R>(page, &values[&main]).expect("as it was written");
        assert!(matches!(elsewhere.open::<R>(page, &values[&main]), Err(PageError::Header { .. })));
        assert!(matches!(later.open::<R>(page, &values[&main]), Err(PageError::Header { .. })));
        if let Some(extra) = extra {
            decoder.open_extra::<R>(page, &values[&extra]).expect("as it was written");
        }
        let first = decoder.records(page, &mut page_records).expect("all are records");
        assert_eq!(first as usize, all.len());
        all.append(&mut page_records);
    }
    all
}

#[test]
fn records_come_back_from_their_pages() {
    let tets: Vec<SealedTet> = (0..10_000u32)
        .map(|i| SealedTet { nodes: [i, i + 1, 7 * i, 100_000 - i], region: i % 3 })
        .collect();
    let place = TetLinks { neighbors: [NONE, 17, 4 * 5000 + 3, 8], required: 0b1001, flags: 1 };
    assert_eq!(through(&tets, |t| t.to_working(&place)), tets);

    let own = SubdomainId::new(RANK).expect("a small rank");
    let vertices: Vec<SealedVertex> = (0..9000u32)
        .map(|i| {
            let (tag, owner, index) = match i % 4 {
                0 => (tag::SURFACE, Owner::Surface, 5 * i),
                1 => (tag::INTERFACE, Owner::Cut(1 + i % 7), 3 * i),
                2 => (tag::STEINER, Owner::Subdomain(own), i),
                _ => (tag::FREE, Owner::Subdomain(own), i),
            };
            SealedVertex {
                point: [f64::from(i).sqrt(), -f64::from(i), 1e-300],
                h: 0.5 + i as f32,
                tag,
                id: VertexId { owner, index }.number(),
            }
        })
        .collect();
    assert_eq!(through(&vertices, |v| v.to_working(RANK)), vertices);

    let facets: Vec<SealedFacet> = (0..3000u32)
        .map(|i| SealedFacet {
            vertices: [i, 2 * i, 70_000 + i],
            label: i % 5,
            triangle: u64::from(i) << 33,
            regions: [0, 1 + i],
            tets: [if i % 2 == 0 { NONE } else { i }, 9 * i],
        })
        .collect();
    assert_eq!(through(&facets, SealedFacet::to_working), facets);

    let faces: Vec<InterfaceFace> = (0..2047u32)
        .map(|i| InterfaceFace {
            vertices: [i, 2 * i, 70_000 + i],
            cut: 1 + i % 4,
            index: i,
            other: i % 9,
            tet: 40_000 + i,
        })
        .collect();
    assert_eq!(through(&faces, |f| f.to_working(RANK)), faces);
    assert_eq!(through::<SealedTet>(&[], |t| t.to_working(&place)), []);
}

#[test]
fn a_slot_without_a_tetrahedron_is_damage() {
    let tet = SealedTet { nodes: [0, 1, 2, 3], region: 1 };
    let place = TetLinks { neighbors: [NONE; 4], required: 0, flags: 0 };
    let mut packer = PagePacker::new(RANK, GENERATION);
    packer.push(tet, tet.to_working(&place));
    let set = packer.cut().expect("one record");
    let mut decoder = PageDecoder::new(RANK, GENERATION);
    let open = decoder.open::<SealedTet>(0, &set.values[0].1);
    let extra = decoder.open_extra::<SealedTet>(0, &set.values[1].1);
    assert_eq!((open, extra), (Ok(()), Ok(())));
    let mut records = Vec::<SealedTet>::new();
    assert_eq!(decoder.records(0, &mut records), Ok(0));
    assert_eq!(records, [tet]);
    let mut frame = vec![[u32_le::from_native(0); 8]; SLOTS];
    let address = PageAddress { kind: PageKind::Tets, subdomain: RANK, page: 0 };
    open_page(&set.values[0].1, address, &mut frame).expect("as it was written");
    for count in [0, 2, 2047] {
        seal_full_page(&mut frame, address, GENERATION, count);
        let open = decoder.open::<SealedTet>(0, stored_bytes(&frame));
        assert_eq!(open, Ok(()));
        assert!(decoder.records(0, &mut records).is_err(), "{count}");
    }
}
