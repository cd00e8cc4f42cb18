//! Notes for the user about the points of a scene before the run.

use mechanics::fill::FilledRegion;

/// Largest number of groups that have a line each about their area; more are summarised in one line.
const LINES: usize = 8;

/// Notes about the difference in area between the points of each group and the region that they fill.
pub fn areas<'a>(groups: impl Iterator<Item = (&'a str, &'a FilledRegion)>) -> Vec<String> {
    let error = |points: &FilledRegion| {
        let filled = points.positions.len() as f64 * points.box_area();
        Some(filled / points.area? - 1.0).filter(|error| error.abs() > 1e-12)
    };
    let off: Vec<(&str, usize, f64)> = groups
        .filter_map(|(name, points)| Some((name, points.positions.len(), 100.0 * error(points)?)))
        .collect();
    if off.len() <= LINES {
        let line = |(name, count, percent): &(&str, usize, f64)| {
            format!("group '{name}': {count} points, area off by {percent:+.3} %")
        };
        return off.iter().map(line).collect();
    }
    let by_error = |a: &&(&str, usize, f64), b: &&(&str, usize, f64)| a.2.total_cmp(&b.2);
    let [least, most] = [off.iter().min_by(by_error), off.iter().max_by(by_error)];
    let named = least.zip(most).map(|(least, most)| {
        format!(
            "{} groups of {} points, areas off by {:+.3} % (group '{}') to {:+.3} % (group '{}')",
            off.len(),
            off.iter().map(|group| group.1).sum::<usize>(),
            least.2,
            least.0,
            most.2,
            most.0
        )
    });
    named.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A region of 2 m^2 with so many points of 1 m^2 each.
    fn filled(count: usize) -> FilledRegion {
        FilledRegion {
            positions: vec![[0.0; 2]; count],
            sides: [1.0; 2],
            area: Some(2.0),
        }
    }

    #[test]
    fn few_groups_have_a_line_each_and_many_one_together() {
        let notes = |counts: &[usize]| {
            let regions: Vec<(String, FilledRegion)> = (0..)
                .zip(counts)
                .map(|(g, &count)| (format!("g{g}"), filled(count)))
                .collect();
            areas(regions.iter().map(|(name, region)| (&**name, region)))
        };
        assert!(notes(&[2, 2]).is_empty());
        assert_eq!(
            notes(&[3, 2, 1]),
            [
                "group 'g0': 3 points, area off by +50.000 %",
                "group 'g2': 1 points, area off by -50.000 %"
            ]
        );
        assert_eq!(notes(&[3; LINES]).len(), LINES);
        let many = [&[3; LINES][..], &[2, 1, 4]].concat();
        assert_eq!(
            notes(&many),
            [
                "10 groups of 29 points, areas off by -50.000 % (group 'g9') to +100.000 % (group 'g10')"
            ]
        );
    }
}
