//! A tree of boxes over items whose neighbors in number are near in space.

use tetdb_base::geom::Aabb;

/// Children of a box of the tree.
const FAN: usize = 8;

/// Shape: `levels[0][i]` = box around items `8 i..8 i + 8`; each level above holds eight boxes of the one below.
///
/// Items themselves are not kept: callers test the eight.
pub(crate) struct OctalBoxTree {
    levels: Vec<Vec<Aabb>>,
    n: usize,
}

impl OctalBoxTree {
    /// Over `n` items.
    pub fn new(n: usize, item: impl Fn(usize) -> Aabb) -> Self {
        let around = |boxes: &mut dyn Iterator<Item = Aabb>| boxes.fold(Aabb::EMPTY, Aabb::union);
        let groups = n.div_ceil(FAN);
        let mut levels = Vec::new();
        let mut level: Vec<Aabb> =
            (0..groups).map(|g| around(&mut (g * FAN..n.min((g + 1) * FAN)).map(&item))).collect();
        while level.len() > FAN {
            let above =
                level.chunks(FAN).map(|children| around(&mut children.iter().copied())).collect();
            levels.push(std::mem::replace(&mut level, above));
        }
        levels.push(level);
        Self { levels, n }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().map(Vec::len).sum();
        boxes * size_of::<Aabb>()
    }

    /// Calls `each` with the items, ascending, whose group of eight has a box that `meets`.
    pub fn visit(&self, meets: &impl Fn(&Aabb) -> bool, each: &mut impl FnMut(usize)) {
        let top = self.levels.len() - 1;
        for i in 0..self.levels[top].len() {
            self.descend(top, i, meets, each);
        }
    }

    fn descend(
        &self,
        level: usize,
        i: usize,
        meets: &impl Fn(&Aabb) -> bool,
        each: &mut impl FnMut(usize),
    ) {
        if !meets(&self.levels[level][i]) {
            return;
        }
        let below = if level == 0 { self.n } else { self.levels[level - 1].len() };
        for child in i * FAN..below.min((i + 1) * FAN) {
            match level {
                0 => each(child),
                _ => self.descend(level - 1, child, meets, each),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::Point;

    #[test]
    fn nothing_that_meets_is_left_out() {
        for n in [0usize, 1, 7, 8, 9, 64, 65, 1000] {
            let item = |i: usize| {
                let low = Point::splat(i as f64);
                Aabb { low, high: low + 1.5 }
            };
            let tree = OctalBoxTree::new(n, item);
            for at in [-1.0, 0.0, 3.25, 500.0, 1002.0] {
                let mut found = Vec::new();
                let holds = |b: &Aabb| b.low.x <= at && at <= b.high.x;
                tree.visit(&holds, &mut |i| found.push(i));
                assert!(found.is_sorted());
                let expected: Vec<usize> = (0..n).filter(|&i| holds(&item(i))).collect();
                found.retain(|&i| holds(&item(i)));
                assert_eq!(found, expected);
            }
        }
    }
}
