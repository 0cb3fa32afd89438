//! Digits drawn without a font, three by five dots each.

/// Dots of each character: rows from the top, the left dot in the highest bit.
const GLYPHS: [(char, [u8; 5]); 14] = [
    ('0', [0b111, 0b101, 0b101, 0b101, 0b111]),
    ('1', [0b010, 0b110, 0b010, 0b010, 0b111]),
    ('2', [0b111, 0b001, 0b111, 0b100, 0b111]),
    ('3', [0b111, 0b001, 0b111, 0b001, 0b111]),
    ('4', [0b101, 0b101, 0b111, 0b001, 0b001]),
    ('5', [0b111, 0b100, 0b111, 0b001, 0b111]),
    ('6', [0b111, 0b100, 0b111, 0b101, 0b111]),
    ('7', [0b111, 0b001, 0b010, 0b010, 0b010]),
    ('8', [0b111, 0b101, 0b111, 0b101, 0b111]),
    ('9', [0b111, 0b101, 0b111, 0b001, 0b111]),
    ('.', [0b000, 0b000, 0b000, 0b000, 0b010]),
    ('-', [0b000, 0b000, 0b111, 0b000, 0b000]),
    ('+', [0b000, 0b010, 0b111, 0b010, 0b000]),
    ('e', [0b000, 0b011, 0b111, 0b100, 0b011]),
];

/// Formats a number in at most nine characters.
pub(super) fn shown(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e5 => {
            let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.digits$}")
        }
        _ => format!("{x:.2e}"),
    }
}

/// Returns the dots of a text, as column and row.
pub(super) fn pixels(text: &str) -> impl Iterator<Item = [u8; 2]> + '_ {
    text.chars().zip(0u8..).flat_map(|(c, place)| {
        let glyph = GLYPHS.iter().find(|(g, _)| *g == c).map(|(_, rows)| *rows);
        let rows = glyph.unwrap_or([0; 5]).into_iter().zip(0u8..);
        rows.flat_map(move |(bits, row)| {
            let dots = (0..3u8).filter(move |i| bits >> (2 - i) & 1 != 0);
            dots.map(move |i| [4 * place + i, row])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_every_character_has_dots() {
        for (x, text) in [
            (1.0, "1.000"),
            (0.0, "0"),
            (0.01234, "0.01234"),
            (12345.6, "12346"),
            (-2.5e-7, "-2.50e-7"),
            (1.5e9, "1.50e9"),
        ] {
            assert_eq!(shown(x), text);
            let columns = pixels(text).map(|[column, _]| column / 4);
            let mut seen: Vec<u8> = columns.collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), text.len());
        }
    }
}
