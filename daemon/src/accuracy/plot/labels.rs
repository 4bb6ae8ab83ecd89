//! Labels beside points, where they cover neither a point nor each other.

/// A rectangle: left, top, right, bottom.
type Room = [f64; 4];

/// Height of a label in pixels.
pub const HEIGHT: f64 = 12.0;
/// Width of a character in pixels, about.
const CHARACTER: f64 = 6.4;
/// Half the side of a point's mark.
const MARK: f64 = 5.0;

/// What is taken on a page.
pub struct Labels {
    taken: Vec<Room>,
    page: Room,
}

impl Labels {
    /// A page with marks at these points.
    pub fn around(points: impl Iterator<Item = [f64; 2]>, page: Room) -> Labels {
        let taken = points.map(|[x, y]| [x - MARK, y - MARK, x + MARK, y + MARK]).collect();
        Labels { taken, page }
    }

    /// Where the middle of the base line of a label of this point goes; `None` when there is no room.
    pub fn place(&mut self, [x, y]: [f64; 2], text: &str) -> Option<[f64; 2]> {
        let width = CHARACTER * text.chars().count() as f64;
        let beside = MARK + 2.0 + 0.5 * width;
        let (above, below) = (y - MARK - 3.0, y + MARK + HEIGHT - 1.0);
        let level = y + 0.3 * HEIGHT;
        let places = [
            [x, above],
            [x, below],
            [x + beside, above],
            [x + beside, level],
            [x - beside, level],
            [x + beside, below],
            [x - beside, above],
            [x - beside, below],
        ];
        let place = places.into_iter().find(|&place| self.is_free(room(place, width)))?;
        self.taken.push(room(place, width));
        Some(place)
    }

    fn is_free(&self, [left, top, right, bottom]: Room) -> bool {
        let apart = |other: &Room| other[2] < left || right < other[0] || other[3] < top || bottom < other[1];
        let [first, ceiling, last, floor] = self.page;
        left >= first && top >= ceiling && right <= last && bottom <= floor && self.taken.iter().all(apart)
    }
}

fn room([x, base]: [f64; 2], width: f64) -> Room {
    [x - 0.5 * width, base - 0.8 * HEIGHT, x + 0.5 * width, base + 0.2 * HEIGHT]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_avoid_points_and_each_other_and_are_left_out_where_there_is_no_room() {
        let points = [[50.0, 50.0], [50.0, 42.0]];
        let mut labels = Labels::around(points.into_iter(), [0.0, 0.0, 100.0, 100.0]);
        let first = labels.place(points[0], "12").expect("there is room");
        assert!(first[1] > 50.0, "above is the other point");
        let second = labels.place(points[0], "13").expect("there is room beside");
        assert_ne!(first, second);
        let mut crowded = Labels::around(std::iter::once([5.0, 5.0]), [0.0, 0.0, 10.0, 10.0]);
        assert_eq!(crowded.place([5.0, 5.0], "a long label"), None);
    }
}
