//! Tetrahedra around a vertex or an edge, and neighbors of a tetrahedron: all share some vertices.
//!
//! A vertex has one position in all its sub-domains, and every tetrahedron with the vertex is in a chunk whose
//! box holds that position: neither neighbors nor interfaces need be followed.

use tetdb_schema::ids::{Owner, TetId, VertexId};

use super::hit::Hit;
use super::selection::{Selection, Sharing};
use super::{QueryError, QuerySession};
use tetdb_base::geom::Point;
use tetdb_base::storage::check_cancelled;

impl QuerySession {
    /// One tetrahedron. Errors: the store has no such one.
    pub fn tet(&mut self, id: TetId) -> Result<Hit, QueryError> {
        let selection = Selection { tets: Some(vec![id]), ..Selection::default() };
        let found = self.select(selection)?.next();
        found.unwrap_or(Err(QueryError::NoTet { id }))
    }

    /// Tetrahedra that have all these vertices: the ball of one, the shell of an edge.
    ///
    /// Reads vertices in order until those of the surface and of cuts are found. Errors: the store has no such
    /// vertex; two vertices that no edge joins.
    pub fn around(&mut self, vertices: &[VertexId]) -> Result<Sharing, QueryError> {
        let mut placed = Vec::new();
        for &id in vertices {
            placed.push((id.number(), self.vertex(id)?));
        }
        let sharing = Sharing { at_least: placed.len(), vertices: placed, except: None };
        if let &[a, b] = vertices {
            let selection = Selection { sharing: Some(sharing.clone()), ..Selection::default() };
            if self.select(selection)?.next().is_none() {
                return Err(QueryError::NoEdge(a, b));
            }
        }
        Ok(sharing)
    }

    /// Tetrahedra that share a face with this one. Errors: the store has no such one.
    pub fn next_to(&mut self, id: TetId) -> Result<Sharing, QueryError> {
        let tet = self.tet(id)?;
        Ok(Sharing {
            vertices: tet.vertices.into_iter().zip(tet.corners).collect(),
            at_least: 3,
            except: Some(id),
        })
    }

    /// Position of a vertex.
    fn vertex(&mut self, id: VertexId) -> Result<Point, QueryError> {
        let ranks: Vec<u32> = match id.owner {
            Owner::Subdomain(s) => {
                let own = self.rows.iter().filter(|row| row.rank == s.rank());
                own.map(|row| row.rank).collect()
            }
            _ => self.rows.iter().map(|row| row.rank).collect(),
        };
        for rank in ranks {
            if let Some(point) = self.vertex_in(rank, id)? {
                return Ok(point);
            }
        }
        Err(QueryError::NoVertex { id })
    }

    fn vertex_in(&mut self, rank: u32, id: VertexId) -> Result<Option<Point>, QueryError> {
        let part = &mut self.part(rank)?.subdomain;
        // A sub-domain's own vertices have the numbers of their ids.
        if u64::from(id.index) < part.row().vertices {
            let corner = part.corner(id.index)?;
            if corner.id == id.number() {
                return Ok(Some(corner.point));
            }
        }
        let mut read = 0;
        let mut found = None;
        for chunk in part.vertex_chunks() {
            check_cancelled();
            read += 1;
            let chunk = chunk?;
            if let Some(vertex) = chunk.records.iter().find(|v| v.id == id.number()) {
                found = Some(Point::from_array(vertex.point));
                break;
            }
        }
        self.count_vertices(rank, read);
        Ok(found)
    }
}
