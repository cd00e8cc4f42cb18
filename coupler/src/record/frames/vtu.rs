//! VTK's XML files of unstructured grids: what ParaView, meshio and pyvista read.
//!
//! Arrays stand in the file as base64 of their length in bytes (u64) and their numbers, all little-endian.

use std::io;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use quick_xml::events::{BytesStart, BytesText, Event};
use quick_xml::{Reader, Writer};

/// What the cells of a mesh are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// Points.
    Vertex,
    /// Polygons.
    Polygon,
}

impl Cell {
    /// VTK's number of it.
    const fn number(self) -> u8 {
        match self {
            Self::Vertex => 1,
            Self::Polygon => 7,
        }
    }
}

/// Numbers of each point, or of each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name.
    pub name: String,
    /// Numbers of one point or cell.
    pub components: usize,
    /// All numbers, one point or cell after the other.
    pub values: Vec<f64>,
}

/// Cells of one kind, each of points of its own, in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// What the cells are.
    pub cell: Cell,
    /// m.
    pub points: Vec<[f64; 2]>,
    /// Where in the points each cell ends; it begins where the one before ends.
    pub ends: Vec<usize>,
    /// Numbers of the points.
    pub of_points: Vec<Array>,
    /// Numbers of the cells.
    pub of_cells: Vec<Array>,
}

impl Mesh {
    /// The numbers of this name, of points or cells.
    pub fn array(&self, name: &str) -> Option<&Array> {
        let mut all = self.of_points.iter().chain(&self.of_cells);
        all.find(|array| array.name == name)
    }

    /// The points of each cell.
    pub fn cells(&self) -> impl Iterator<Item = &[[f64; 2]]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins
            .zip(&self.ends)
            .map(|(begin, &end)| &self.points[begin..end])
    }

    /// As a file.
    pub fn to_xml(&self) -> Vec<u8> {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
        self.write(&mut xml).expect("memory takes what is written");
        xml.into_inner()
    }

    fn write(&self, xml: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let file = [("type", "UnstructuredGrid"), ("version", "1.0")];
        let coding = [("byte_order", "LittleEndian"), ("header_type", "UInt64")];
        let file = xml
            .create_element("VTKFile")
            .with_attributes(file.into_iter().chain(coding));
        file.write_inner_content(|xml| {
            let grid = xml.create_element("UnstructuredGrid");
            grid.write_inner_content(|xml| self.write_piece(xml))?;
            Ok(())
        })?;
        Ok(())
    }

    fn write_piece(&self, xml: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let (points, cells) = (self.points.len().to_string(), self.ends.len().to_string());
        let counts = [
            ("NumberOfPoints", points.as_str()),
            ("NumberOfCells", &cells),
        ];
        let piece = xml.create_element("Piece").with_attributes(counts);
        piece.write_inner_content(|xml| {
            section(xml, "PointData", |xml| {
                self.of_points.iter().try_for_each(|a| a.write(xml))
            })?;
            section(xml, "CellData", |xml| {
                self.of_cells.iter().try_for_each(|a| a.write(xml))
            })?;
            section(xml, "Points", |xml| {
                let values = self.points.iter().flat_map(|&[x, y]| [x, y, 0.0]);
                array(
                    xml,
                    ("Points", 3, "Float64"),
                    values.flat_map(f64::to_le_bytes),
                )
            })?;
            section(xml, "Cells", |xml| {
                let order = (0..self.points.len() as u64).flat_map(u64::to_le_bytes);
                array(xml, ("connectivity", 1, "Int64"), order)?;
                let ends = self.ends.iter().flat_map(|&end| (end as u64).to_le_bytes());
                array(xml, ("offsets", 1, "Int64"), ends)?;
                let kinds = self.ends.iter().map(|_| self.cell.number());
                array(xml, ("types", 1, "UInt8"), kinds)
            })
        })?;
        Ok(())
    }

    /// Reads a file that [`Self::to_xml`] has made.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_xml(xml: &[u8]) -> Result<Self, String> {
        let mut mesh = Self {
            cell: Cell::Vertex,
            points: Vec::new(),
            ends: Vec::new(),
            of_points: Vec::new(),
            of_cells: Vec::new(),
        };
        let text = std::str::from_utf8(xml).map_err(|e| e.to_string())?;
        let mut reader = Reader::from_str(text);
        let (mut section, mut header) = (String::new(), None);
        loop {
            match reader.read_event().map_err(|e| e.to_string())? {
                Event::Eof => return mesh.whole(),
                Event::Start(element) => {
                    let name = element.name().as_ref().to_owned();
                    if name == "DataArray" {
                        header = Some(Header::of(&element)?);
                    } else {
                        section = name;
                    }
                }
                Event::Text(text) => {
                    if let Some(header) = header.take() {
                        mesh.take(&section, header, text.as_bytes())?;
                    }
                }
                Event::End(_) => header = None,
                _ => {}
            }
        }
    }

    /// Takes an array of a section of the file.
    fn take(&mut self, section: &str, header: Header, text: &[u8]) -> Result<(), String> {
        let bytes = BASE64
            .decode(text.trim_ascii())
            .map_err(|e| e.to_string())?;
        let (length, bytes) = bytes
            .split_first_chunk()
            .ok_or_else(|| format!("`{}` has no length", header.name))?;
        if u64::from_le_bytes(*length) != bytes.len() as u64 {
            return Err(format!("`{}` is not as long as it says", header.name));
        }
        let (words, _) = bytes.as_chunks::<8>();
        let reals = || words.iter().map(|word| f64::from_le_bytes(*word));
        match (section, header.name.as_str()) {
            ("Points", _) => {
                let values: Vec<f64> = reals().collect();
                self.points = values
                    .as_chunks::<3>()
                    .0
                    .iter()
                    .map(|&[x, y, _]| [x, y])
                    .collect();
            }
            ("Cells", "offsets") => {
                self.ends = words
                    .iter()
                    .map(|word| u64::from_le_bytes(*word) as usize)
                    .collect();
            }
            ("Cells", "types") if bytes.first() == Some(&Cell::Polygon.number()) => {
                self.cell = Cell::Polygon;
            }
            ("PointData" | "CellData", _) => {
                let array = Array {
                    name: header.name,
                    components: header.components,
                    values: reals().collect(),
                };
                if section == "PointData" {
                    self.of_points.push(array);
                } else {
                    self.of_cells.push(array);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether the arrays fit the points and cells.
    fn whole(self) -> Result<Self, String> {
        let mut ends = [0].iter().chain(&self.ends).zip(&self.ends);
        let rising = ends.all(|(a, b)| a <= b);
        if !rising || self.ends.last().is_some_and(|&end| end > self.points.len()) {
            return Err("cells of points that are not there".into());
        }
        // A product that does not fit is not the number of what is there either.
        let of = |count: usize| {
            move |a: &&Array| Some(a.values.len()) != a.components.checked_mul(count)
        };
        let wrong = self.of_points.iter().find(of(self.points.len()));
        match wrong.or_else(|| self.of_cells.iter().find(of(self.ends.len()))) {
            Some(array) => Err(format!("`{}` is not of every point or cell", array.name)),
            None => Ok(self),
        }
    }
}

impl Array {
    fn write(&self, xml: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let bytes = self.values.iter().flat_map(|value| value.to_le_bytes());
        array(xml, (&self.name, self.components, "Float64"), bytes)
    }
}

/// What an array says of itself.
struct Header {
    name: String,
    components: usize,
}

impl Header {
    fn of(element: &BytesStart) -> Result<Self, String> {
        let components = attribute(element, "NumberOfComponents")?;
        Ok(Self {
            name: attribute(element, "Name")?,
            components: components
                .parse()
                .map_err(|e| format!("{components}: {e}"))?,
        })
    }
}

fn section(
    xml: &mut Writer<Vec<u8>>,
    name: &str,
    content: impl FnOnce(&mut Writer<Vec<u8>>) -> io::Result<()>,
) -> io::Result<()> {
    xml.create_element(name).write_inner_content(content)?;
    Ok(())
}

fn array(
    xml: &mut Writer<Vec<u8>>,
    (name, components, kind): (&str, usize, &str),
    bytes: impl Iterator<Item = u8>,
) -> io::Result<()> {
    let mut all = vec![0; 8];
    all.extend(bytes);
    let length = (all.len() - 8) as u64;
    all[..8].copy_from_slice(&length.to_le_bytes());
    let components = components.to_string();
    let about = [("type", kind), ("Name", name)];
    let coding = [
        ("NumberOfComponents", components.as_str()),
        ("format", "binary"),
    ];
    xml.create_element("DataArray")
        .with_attributes(about.into_iter().chain(coding))
        .write_text_content(BytesText::new(&BASE64.encode(&all)))?;
    Ok(())
}

/// The text of an attribute.
pub(super) fn attribute(element: &BytesStart, name: &str) -> Result<String, String> {
    let found = element.try_get_attribute(name).map_err(|e| e.to_string())?;
    let found = found.ok_or_else(|| format!("an element without `{name}`"))?;
    let value = found.normalized_value(quick_xml::XmlVersion::Implicit1_0);
    Ok(value.map_err(|e| e.to_string())?.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_reads_back_to_the_same_bits() {
        let array = |name: &str, components, values: &[f64]| Array {
            name: name.into(),
            components,
            values: values.to_vec(),
        };
        let mesh = Mesh {
            cell: Cell::Polygon,
            points: vec![
                [0.0, 0.1 + 0.2],
                [1.0, -1e-300 / 3.0],
                [0.5, 2.0],
                [1.5, 2.5],
            ],
            ends: vec![3, 4],
            of_points: vec![array("a & b", 1, &[1.0, 2.0, -0.0, 5e-324])],
            of_cells: vec![array("velocity", 2, &[f64::MAX, 0.0, 1.0, 2.0])],
        };
        assert_eq!(Mesh::from_xml(&mesh.to_xml()), Ok(mesh.clone()));
        let lengths: Vec<usize> = mesh.cells().map(<[_]>::len).collect();
        assert_eq!(lengths, [3, 1]);
        let empty = Mesh {
            cell: Cell::Vertex,
            points: Vec::new(),
            ends: Vec::new(),
            of_points: Vec::new(),
            of_cells: Vec::new(),
        };
        assert_eq!(Mesh::from_xml(&empty.to_xml()), Ok(empty));
        // Half a file, and one whose array is too short.
        let xml = mesh.to_xml();
        assert!(Mesh::from_xml(&xml[..xml.len() / 2]).is_err());
        let mut short = mesh.clone();
        short.of_cells[0].values.pop();
        assert!(Mesh::from_xml(&short.to_xml()).is_err());
        // Two cells of 2^63 components: none, as far as a product of 64 bits can tell.
        let mut vast = mesh;
        vast.of_cells[0].components = 1 << 63;
        vast.of_cells[0].values.clear();
        assert!(Mesh::from_xml(&vast.to_xml()).is_err());
    }
}
