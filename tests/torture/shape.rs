//! A named triangle soup, and changes that keep it the same shape.

use tetdb_base::geom::Point;
use tetdb_base::surface::{Surface, SurfaceBuilder};

use super::random::Random;

/// Points and triangles. Triangles are counter-clockwise seen from outside if the constructor ensures it.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    pub name: String,
    pub points: Vec<Point>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Adds a point and returns its index.
    pub fn point(&mut self, x: f64, y: f64, z: f64) -> u32 {
        self.points.push(Point::new(x, y, z));
        self.points.len() as u32 - 1
    }

    /// Adds two triangles, cut from `a` to `c` or from `b` to `d`.
    pub fn quad(&mut self, [a, b, c, d]: [u32; 4], from_a: bool) {
        if from_a {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            self.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }

    pub fn named(mut self, suffix: &str) -> Self {
        self.name.push_str(suffix);
        self
    }

    /// Moves every point.
    pub fn mapped(mut self, mut to: impl FnMut(Point) -> Point) -> Self {
        self.points.iter_mut().for_each(|p| *p = to(*p));
        self
    }

    /// Adds another shape. Equal points stay separate until the surface is welded.
    pub fn with(mut self, other: &Self) -> Self {
        let base = self.points.len() as u32;
        self.points.extend(&other.points);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
        self
    }

    /// Rotates the shape at random.
    pub fn turned(self, random: &mut Random) -> Self {
        let q = rotation(random);
        let mut turned = self.mapped(|p| {
            let [x, y, z] = p.to_array();
            q[0] * x + q[1] * y + q[2] * z
        });
        turned.name.push_str(", turned");
        turned
    }

    pub fn scaled(self, by: f64) -> Self {
        self.mapped(|p| p * by).named(&format!(", times {by:e}"))
    }

    pub fn moved(self, by: Point) -> Self {
        self.mapped(|p| p + by).named(&format!(", moved by {}", by.length()))
    }

    /// The same surface with vertices, triangles and corners in another order.
    pub fn shuffled(mut self, random: &mut Random) -> Self {
        let n = self.points.len();
        let mut place: Vec<u32> = (0..n as u32).collect();
        for i in (1..n).rev() {
            place.swap(i, random.below(i + 1));
        }
        let mut points = vec![Point::ZERO; n];
        for (p, &to) in self.points.iter().zip(&place) {
            points[to as usize] = *p;
        }
        self.points = points;
        for t in &mut self.triangles {
            *t = t.map(|v| place[v as usize]);
            t.rotate_left(random.below(3));
        }
        for i in (1..self.triangles.len()).rev() {
            self.triangles.swap(i, random.below(i + 1));
        }
        self.name.push_str(", shuffled");
        self
    }

    /// The welded surface.
    pub fn surface(&self) -> Surface {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file(&self.name);
        let label = builder.label("made");
        for &p in &self.points {
            builder.vertex(p).expect("few vertices");
        }
        for &t in &self.triangles {
            builder.triangle(t, label).expect("few triangles");
        }
        builder.end_file().expect("every corner is there");
        builder.finish()
    }

    /// The shape as an OFF file, for inspection.
    pub fn to_off(&self) -> String {
        let mut text = format!("OFF\n{} {} 0\n", self.points.len(), self.triangles.len());
        for p in &self.points {
            text += &format!("{:?} {:?} {:?}\n", p.x, p.y, p.z);
        }
        for [a, b, c] in &self.triangles {
            text += &format!("3 {a} {b} {c}\n");
        }
        text
    }
}

/// Columns of a random rotation.
fn rotation(random: &mut Random) -> [Point; 3] {
    let mut draw = || {
        let v = [(); 3].map(|()| random.between(-1.0, 1.0));
        Point::from_array(v)
    };
    loop {
        let (a, b) = (draw(), draw());
        let c = a.cross(b);
        if a.length() > 0.1 && c.length() > 0.1 {
            let (a, c) = (a / a.length(), c / c.length());
            return [a, c.cross(a), c];
        }
    }
}
