//! A schedule as text and as a picture.

use super::{Node, NodeId, Schedule};
use core::fmt::{self, Write};

/// A table: what each round does.
impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} bodies, {} paths, {} chunks, {} joins, {} rake sums, {} rounds",
            self.order().len(),
            self.paths().len(),
            self.chunks().len(),
            self.joins().len(),
            self.sums().len(),
            self.round_count()
        )?;
        writeln!(f, "round   chunks    joins     sums")?;
        for round in 0..self.round_count() {
            writeln!(
                f,
                "{round:5} {:8} {:8} {:8}",
                self.chunks_in(round).len(),
                self.joins_in(round).len(),
                self.sums_in(round).len()
            )?;
        }
        Ok(())
    }
}

/// Distance of two rounds and of two chunks in the picture, margin.
const STEP: (f64, f64) = (14.0, 28.0);
const MARGIN: f64 = 20.0;

impl Schedule {
    /// The tree as an SVG picture: rounds from bottom to top, chunks (squares) from left to right path
    /// by path, joins (discs) and rake sums (rings) above the middle of what they put together, rakes
    /// dashed. For hundreds of bodies rather than thousands.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let places = self.places();
        #[expect(clippy::cast_precision_loss, reason = "a picture's size")]
        let (width, height) = (
            2.0 * MARGIN + STEP.0 * self.chunks().len() as f64,
            2.0 * MARGIN + STEP.1 * self.round_count() as f64,
        );
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             fill=\"none\" stroke=\"#456\">\n"
        );
        let at = |id: NodeId| {
            let (x, round) = places[id.index()];
            (MARGIN + STEP.0 * x, height - MARGIN - STEP.1 * round)
        };
        let line = |svg: &mut String, from: NodeId, to: NodeId, style: &str| {
            let ((x1, y1), (x2, y2)) = (at(from), at(to));
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"{style}/>"
            );
        };
        let dashed = " stroke-dasharray=\"3 2\"";
        for (index, join) in self.joins().iter().enumerate() {
            let id = self.join_node(index);
            line(&mut svg, join.inboard, id, "");
            line(&mut svg, join.outboard, id, "");
        }
        for (index, sum) in self.sums().iter().enumerate() {
            for part in sum.parts {
                line(&mut svg, part, self.sum_node(index), dashed);
            }
        }
        for (index, chunk) in self.chunks().iter().enumerate() {
            for (body, _) in self.members(chunk) {
                for &raked in self.rakes(body) {
                    line(&mut svg, raked, self.chunk_node(index), dashed);
                }
            }
        }
        for index in 0..self.node_count() {
            let id = super::node_id(index);
            let (x, y) = at(id);
            let _ = match self.node(id) {
                Some(Node::Chunk(_)) => writeln!(
                    svg,
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\" fill=\"#fff\"/>",
                    x - 4.0,
                    y - 4.0
                ),
                Some(Node::Join(_)) => writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#456\"/>"
                ),
                _ => writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#fff\"/>"
                ),
            };
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// Column and round of every node: chunks side by side along the paths, what puts two together
    /// above their middle.
    fn places(&self) -> Vec<(f64, f64)> {
        let mut columns: Vec<usize> = (0..self.chunks().len()).collect();
        columns.sort_by_key(|&chunk| self.chunks()[chunk].joints().start);
        let mut places = vec![(0.0, 0.0); self.node_count()];
        #[expect(clippy::cast_precision_loss, reason = "a place in a picture")]
        for (column, &chunk) in columns.iter().enumerate() {
            places[chunk].0 = column as f64;
        }
        for round in 0..self.round_count() {
            #[expect(clippy::cast_precision_loss, reason = "a place in a picture")]
            let height = round as f64;
            for chunk in self.chunks_in(round) {
                places[chunk].1 = height;
            }
            let joins = self.joins_in(round).map(|index| {
                let join = self.joins()[index];
                (self.join_node(index), [join.inboard, join.outboard])
            });
            let sums = self
                .sums_in(round)
                .map(|index| (self.sum_node(index), self.sums()[index].parts));
            for (id, [a, b]) in joins.chain(sums) {
                let middle = 0.5 * (places[a.index()].0 + places[b.index()].0);
                places[id.index()] = (middle, height);
            }
        }
        places
    }
}
