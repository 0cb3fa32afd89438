//! Colors for values and for categories.

/// Red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rgb(pub [u8; 3]);

impl Rgb {
    /// Mixes this color with a share of another, 0 to 1.
    #[must_use]
    pub fn mixed(self, other: Self, share: f32) -> Self {
        let mix = |a: u8, b: u8| f32::from(a) + share * (f32::from(b) - f32::from(a));
        Self([0, 1, 2].map(|k| mix(self.0[k], other.0[k]).round() as u8))
    }

    /// Darkens this color to a share of its light, 0 to 1.
    #[must_use]
    pub fn lit(self, light: f32) -> Self {
        Self(self.0.map(|c| (f32::from(c) * light) as u8))
    }
}

/// Stops of the color scale from dark blue over green to yellow. Lightness rises throughout, so values differ in gray too.
const STOPS: [[f64; 3]; 6] = [
    [52.0, 28.0, 92.0],
    [52.0, 84.0, 142.0],
    [34.0, 136.0, 140.0],
    [70.0, 182.0, 106.0],
    [172.0, 218.0, 58.0],
    [252.0, 236.0, 120.0],
];

/// Returns the color at a share of the way from the least to the greatest value.
pub fn scale(share: f64) -> Rgb {
    let share = if share.is_nan() { 0.0 } else { share };
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let i = (at as usize).min(STOPS.len() - 2);
    let t = at - i as f64;
    Rgb([0, 1, 2].map(|k| (STOPS[i][k] + t * (STOPS[i + 1][k] - STOPS[i][k])).round() as u8))
}

/// Returns the color of category `n`. Hues are a golden section apart, so that near numbers look different, however many there are. The
/// page's script uses the same formula.
pub fn category(n: u32) -> Rgb {
    let hue = (f64::from(n) * 0.618_033_988_749_895 + 0.58).fract() * 6.0;
    // Every other round of hues is darker.
    let (light, gray) = if (n / 7).is_multiple_of(2) { (225.0, 0.42) } else { (175.0, 0.35) };
    Rgb([5.0, 3.0, 1.0].map(|shift| {
        let k = (shift + hue) % 6.0;
        let dip = f64::min(k, 4.0 - k).clamp(0.0, 1.0);
        (light * (1.0 - (1.0 - gray) * dip)).round() as u8
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_get_lighter_and_kinds_differ() {
        let light = |Rgb([r, g, b]): Rgb| 3 * u32::from(r) + 6 * u32::from(g) + u32::from(b);
        let shares = (0..=100).map(|i| light(scale(f64::from(i) / 100.0)));
        assert!(shares.is_sorted());
        assert_eq!((scale(-1.0), scale(f64::NAN)), (scale(0.0), scale(0.0)));
        for i in 0..64u32 {
            for j in (i.saturating_sub(6)..i).chain(i + 1..i + 6) {
                let (a, b) = (category(i).0, category(j).0);
                let apart: u32 = (0..3).map(|k| u32::from(a[k].abs_diff(b[k]))).sum();
                assert!(apart > 30, "{i} {j}");
            }
        }
    }
}
