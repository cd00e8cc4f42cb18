//! VTK's XML files of unstructured grids, which ParaView, meshio and pyvista read.
//!
//! Arrays are at the end of the file as they are in memory, little-endian, in blocks compressed by zlib (VTK's
//! `appended`, `raw`). VTK calls every position a point; it may be a material point or a corner of a body.

use std::io::{self, Read as _, Write as _};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use interface::files::TABLE;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, Writer};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bytes of an array that are compressed together.
const BLOCK: usize = 1 << 20;
/// Largest size in bytes of all arrays of a file that is read: that of some 15 million points with all fields.
const UNPACKED: u64 = 4 * TABLE;
/// The element before the compressed arrays; an underscore follows it.
const APPENDED: &[u8] = b"<AppendedData encoding=\"raw\">";

/// The array of [`Mesh::names`].
const NAMES: &str = "names";

/// How many digits numbers have in a file. Positions are always whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// All that they have: 64 bits.
    #[default]
    Double,
    /// 32 bits, seven digits: half of the bytes.
    Single,
}

/// What the cells of a mesh are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cell {
    /// Points.
    #[default]
    Vertex,
    /// Lines between two points.
    Line,
    /// Polygons.
    Polygon,
}

impl Cell {
    /// VTK's number of it.
    const fn number(self) -> u8 {
        match self {
            Self::Vertex => 1,
            Self::Line => 3,
            Self::Polygon => 7,
        }
    }
}

/// What the numbers of an array are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Measured.
    Real,
    /// Counted, such as identities, as 64-bit integers.
    Whole,
}

/// Numbers of each point, or of each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name.
    pub name: String,
    /// What its numbers are.
    pub kind: Kind,
    /// Numbers of one point or cell.
    pub components: usize,
    /// All numbers, one point or cell after the other.
    pub values: Vec<f64>,
}

impl Array {
    /// Measured numbers.
    pub fn real(name: &str, components: usize, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            kind: Kind::Real,
            components,
            values,
        }
    }

    /// One counted number of each.
    pub fn whole(name: &str, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            kind: Kind::Whole,
            components: 1,
            values,
        }
    }
}

/// Cells of one kind, each of points of its own, in the plane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// What the cells are.
    pub cell: Cell,
    /// m.
    pub points: Vec<[f64; 2]>,
    /// The index in `points` at which each cell ends; it begins where the one before ends.
    pub ends: Vec<usize>,
    /// Numbers of the points.
    pub of_points: Vec<Array>,
    /// Numbers of the cells.
    pub of_cells: Vec<Array>,
    /// The names of the bodies to which the cells belong, if they have names.
    pub names: Vec<String>,
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
    pub fn to_file(&self, precision: Precision) -> Vec<u8> {
        let mut arrays = Appended {
            precision,
            bytes: Vec::new(),
        };
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
        self.write(&mut xml, &mut arrays)
            .expect("memory takes what is written");
        let mut file = xml.into_inner();
        let end = b"\n</VTKFile>";
        file.truncate(file.len() - end.len());
        file.extend(b"\n ".iter().chain(APPENDED).chain(b"_"));
        file.extend(arrays.bytes);
        // meshio takes the last line end before this element as the end of the arrays.
        file.extend(b"\n</AppendedData>".iter().chain(end));
        file
    }

    fn write(&self, xml: &mut Writer<Vec<u8>>, arrays: &mut Appended) -> io::Result<()> {
        let about = [
            ("type", "UnstructuredGrid"),
            ("version", "1.0"),
            ("byte_order", "LittleEndian"),
            ("header_type", "UInt64"),
            ("compressor", "vtkZLibDataCompressor"),
        ];
        let file = xml.create_element("VTKFile").with_attributes(about);
        file.write_inner_content(|xml| {
            let grid = xml.create_element("UnstructuredGrid");
            grid.write_inner_content(|xml| {
                self.write_names(xml, arrays)?;
                self.write_piece(xml, arrays)
            })?;
            Ok(())
        })?;
        Ok(())
    }

    /// The names as the bytes of a text with a line for each: meshio refuses files with arrays of VTK's type `String`.
    fn write_names(&self, xml: &mut Writer<Vec<u8>>, arrays: &mut Appended) -> io::Result<()> {
        if self.names.is_empty() {
            return Ok(());
        }
        let text = self.names.join("\n");
        section(xml, "FieldData", |xml| {
            let tuples = text.len().to_string();
            let tuples = [("NumberOfTuples", tuples.as_str())];
            arrays.add_bytes(xml, (NAMES, 1, "UInt8"), &tuples, text.as_bytes())
        })
    }

    fn write_piece(&self, xml: &mut Writer<Vec<u8>>, arrays: &mut Appended) -> io::Result<()> {
        let (points, cells) = (self.points.len().to_string(), self.ends.len().to_string());
        let counts = [
            ("NumberOfPoints", points.as_str()),
            ("NumberOfCells", &cells),
        ];
        let piece = xml.create_element("Piece").with_attributes(counts);
        piece.write_inner_content(|xml| {
            section(xml, "PointData", |xml| {
                self.of_points.iter().try_for_each(|a| arrays.add(xml, a))
            })?;
            section(xml, "CellData", |xml| {
                self.of_cells.iter().try_for_each(|a| arrays.add(xml, a))
            })?;
            section(xml, "Points", |xml| {
                let values = self.points.iter().flat_map(|&[x, y]| [x, y, 0.0]);
                let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
                arrays.add_bytes(xml, ("Points", 3, "Float64"), &[], &bytes)
            })?;
            section(xml, "Cells", |xml| {
                let order = (0..self.points.len() as u64).flat_map(u64::to_le_bytes);
                let order: Vec<u8> = order.collect();
                arrays.add_bytes(xml, ("connectivity", 1, "Int64"), &[], &order)?;
                let ends = self.ends.iter().flat_map(|&end| (end as u64).to_le_bytes());
                let ends: Vec<u8> = ends.collect();
                arrays.add_bytes(xml, ("offsets", 1, "Int64"), &[], &ends)?;
                let kinds = vec![self.cell.number(); self.ends.len()];
                arrays.add_bytes(xml, ("types", 1, "UInt8"), &[], &kinds)
            })
        })?;
        Ok(())
    }

    /// Reads a file that [`Self::to_file`] has made.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_file(file: &[u8]) -> Result<Self, String> {
        let mut mesh = Self::default();
        let appended = file.windows(APPENDED.len()).position(|w| w == APPENDED);
        let appended = appended.ok_or("it has no compressed arrays")?;
        let (head, rest) = file.split_at(appended);
        let arrays = rest.get(APPENDED.len() + 1..).unwrap_or_default();
        let text = std::str::from_utf8(head).map_err(|e| e.to_string())?;
        let mut reader = Reader::from_str(text);
        let mut section = String::new();
        let mut room = UNPACKED;
        loop {
            match reader.read_event().map_err(|e| e.to_string())? {
                Event::Eof => return mesh.whole(),
                Event::Start(element) => element.name().as_ref().clone_into(&mut section),
                Event::Empty(element) if element.name().as_ref() == "DataArray" => {
                    mesh.take(&section, Header::of(&element)?, arrays, &mut room)?;
                }
                _ => {}
            }
        }
    }

    /// Takes an array of a section of the file; less `room` (bytes) is left.
    fn take(
        &mut self,
        section: &str,
        header: Header,
        arrays: &[u8],
        room: &mut u64,
    ) -> Result<(), String> {
        let bytes = header.unpack(arrays, room)?;
        match (section, header.name.as_str()) {
            ("Points", _) => {
                let values = header.numbers(&bytes)?;
                let places = values.as_chunks::<3>().0.iter();
                self.points = places.map(|&[x, y, _]| [x, y]).collect();
            }
            ("Cells", "offsets") => {
                let words = bytes.as_chunks::<8>().0.iter();
                self.ends = words.map(|w| u64::from_le_bytes(*w) as usize).collect();
            }
            ("Cells", "types") => {
                let of_kind = |cell: &Cell| bytes.first() == Some(&cell.number());
                let kinds = [Cell::Line, Cell::Polygon];
                self.cell = kinds.into_iter().find(of_kind).unwrap_or(Cell::Vertex);
            }
            ("FieldData", NAMES) => {
                let text = String::from_utf8(bytes).map_err(|e| e.to_string())?;
                self.names = text.split('\n').map(str::to_owned).collect();
            }
            ("PointData" | "CellData", _) => {
                let array = Array {
                    kind: header.kind(),
                    components: header.components,
                    values: header.numbers(&bytes)?,
                    name: header.name,
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
            return Err("cells refer to points that do not exist".into());
        }
        // A product that does not fit is not the number of what is there either.
        let of = |count: usize| {
            move |a: &&Array| Some(a.values.len()) != a.components.checked_mul(count)
        };
        let wrong = self.of_points.iter().find(of(self.points.len()));
        match wrong.or_else(|| self.of_cells.iter().find(of(self.ends.len()))) {
            Some(array) => Err(format!(
                "`{}` does not have one value for each point or cell",
                array.name
            )),
            None => Ok(self),
        }
    }
}

/// The packed arrays of a file that is written.
struct Appended {
    precision: Precision,
    bytes: Vec<u8>,
}

impl Appended {
    fn add(&mut self, xml: &mut Writer<Vec<u8>>, array: &Array) -> io::Result<()> {
        let values = array.values.iter();
        let (kind, bytes): (_, Vec<u8>) = match (array.kind, self.precision) {
            (Kind::Whole, _) => (
                "Int64",
                values.flat_map(|&x| (x as i64).to_le_bytes()).collect(),
            ),
            (Kind::Real, Precision::Double) => {
                ("Float64", values.flat_map(|x| x.to_le_bytes()).collect())
            }
            (Kind::Real, Precision::Single) => (
                "Float32",
                values.flat_map(|&x| (x as f32).to_le_bytes()).collect(),
            ),
        };
        self.add_bytes(xml, (&array.name, array.components, kind), &[], &bytes)
    }

    /// Compresses an array. Writes the number of blocks, the bytes of a block, the bytes of the last one if it is
    /// shorter, the compressed bytes of each, and the blocks.
    fn add_bytes(
        &mut self,
        xml: &mut Writer<Vec<u8>>,
        (name, components, kind): (&str, usize, &str),
        more: &[(&str, &str)],
        bytes: &[u8],
    ) -> io::Result<()> {
        let (components, offset) = (components.to_string(), self.bytes.len().to_string());
        let about = [
            ("type", kind),
            ("Name", name),
            ("NumberOfComponents", &components),
            ("format", "appended"),
            ("offset", &offset),
        ];
        xml.create_element("DataArray")
            .with_attributes(about.into_iter().chain(more.iter().copied()))
            .write_empty()?;
        let (mut sizes, mut packed) = (Vec::new(), Vec::new());
        for block in bytes.chunks(BLOCK) {
            let begin = packed.len();
            let mut packer = ZlibEncoder::new(packed, Compression::fast());
            packer.write_all(block)?;
            packed = packer.finish()?;
            sizes.push(packed.len() - begin);
        }
        let shape = [sizes.len(), BLOCK, bytes.len() % BLOCK];
        let header = shape.into_iter().chain(sizes);
        self.bytes
            .extend(header.flat_map(|size| (size as u64).to_le_bytes()));
        self.bytes.extend(packed);
        Ok(())
    }
}

/// The header of an array.
struct Header {
    name: String,
    kind: String,
    components: usize,
    offset: usize,
}

impl Header {
    fn of(element: &BytesStart) -> Result<Self, String> {
        let number = |name: &str| {
            let text = attribute(element, name)?;
            text.parse().map_err(|e| format!("{name}, {text}: {e}"))
        };
        Ok(Self {
            name: attribute(element, "Name")?,
            kind: attribute(element, "type")?,
            components: match number("NumberOfComponents")? {
                0 => return Err("an array of nothing".into()),
                some => some,
            },
            offset: number("offset")?,
        })
    }

    fn kind(&self) -> Kind {
        if self.kind.starts_with("Float") {
            Kind::Real
        } else {
            Kind::Whole
        }
    }

    /// The bytes of the array, from the compressed `arrays`. Arrays may have the same bytes there.
    fn unpack(&self, arrays: &[u8], room: &mut u64) -> Result<Vec<u8>, String> {
        let short = || format!("`{}` has another length than it declares", self.name);
        let mut rest = arrays.get(self.offset..).ok_or_else(short)?;
        let mut word = || {
            let (word, after) = rest.split_first_chunk().ok_or_else(short)?;
            rest = after;
            usize::try_from(u64::from_le_bytes(*word)).map_err(|e| e.to_string())
        };
        let [count, block, last] = [word()?, word()?, word()?];
        if block > BLOCK || last > block {
            return Err(format!("`{}` has blocks that are too large", self.name));
        }
        let left = room.checked_sub(count.saturating_mul(block) as u64);
        *room = left.ok_or_else(|| format!("`{}` would take too much memory", self.name))?;
        // Each size takes eight bytes, so a false count is recognised.
        let sizes: Vec<usize> = (0..count).map(|_| word()).collect::<Result<_, _>>()?;
        let mut bytes = Vec::new();
        for (k, size) in sizes.into_iter().enumerate() {
            let (packed, after) = rest.split_at_checked(size).ok_or_else(short)?;
            rest = after;
            let whole = if k + 1 == count && last > 0 {
                last
            } else {
                block
            };
            let before = bytes.len();
            ZlibDecoder::new(packed)
                .take(whole as u64 + 1)
                .read_to_end(&mut bytes)
                .map_err(|e| format!("`{}`: {e}", self.name))?;
            if bytes.len() - before != whole {
                return Err(short());
            }
        }
        Ok(bytes)
    }

    fn numbers(&self, bytes: &[u8]) -> Result<Vec<f64>, String> {
        let eight = || bytes.as_chunks::<8>().0.iter();
        let four = || bytes.as_chunks::<4>().0.iter();
        Ok(match self.kind.as_str() {
            "Float64" => eight().map(|x| f64::from_le_bytes(*x)).collect(),
            "Float32" => four().map(|x| f32::from_le_bytes(*x).into()).collect(),
            "Int64" => eight().map(|x| i64::from_le_bytes(*x) as f64).collect(),
            other => return Err(format!("`{}` has numbers of type {other}", self.name)),
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

    fn mesh() -> Mesh {
        Mesh {
            cell: Cell::Polygon,
            points: vec![
                [0.0, 0.1 + 0.2],
                [1.0, -1e-300 / 3.0],
                [0.5, 2.0],
                [1.5, 2.5],
            ],
            ends: vec![3, 4],
            of_points: vec![
                Array::real("a & b", 1, vec![1.0, 2.0, -0.0, 5e-324]),
                Array::whole("id", vec![1.0, 2.0, 9_007_199_254_740_992.0, 0.0]),
            ],
            of_cells: vec![Array::real("velocity", 2, vec![f64::MAX, 0.0, 1.0, 2.0])],
            names: vec!["wedge".into(), "grüner Stein".into()],
        }
    }

    fn read_back(mesh: &Mesh) -> Result<Mesh, String> {
        Mesh::from_file(&mesh.to_file(Precision::Double))
    }

    #[test]
    fn a_mesh_reads_back_to_the_same_bits() {
        let mesh = mesh();
        assert_eq!(read_back(&mesh), Ok(mesh.clone()));
        let lengths: Vec<usize> = mesh.cells().map(<[_]>::len).collect();
        assert_eq!(lengths, [3, 1]);
        let empty = Mesh::default();
        assert_eq!(read_back(&empty), Ok(empty));
        let mut short = mesh.clone();
        short.of_cells[0].values.pop();
        assert!(read_back(&short).is_err());
        // Two cells of 2^63 components: in 64 bits their product is 0.
        let mut vast = mesh;
        vast.of_cells[0].components = 1 << 63;
        vast.of_cells[0].values.clear();
        assert!(read_back(&vast).is_err());
        // Of no component is no value, for any number of cells: who divides by it panicked.
        vast.of_cells[0].components = 0;
        assert!(read_back(&vast).is_err());
    }

    #[test]
    fn arrays_of_many_blocks_read_back() {
        let count = BLOCK / 8;
        for length in [count - 1, count, count + 1, 3 * count] {
            let values: Vec<f64> = (0..length).map(|k| (k as f64).sin()).collect();
            let points = values.iter().map(|&x| [x, 0.0]).collect();
            let mesh = Mesh {
                points,
                ends: (1..=length).collect(),
                of_points: vec![Array::real("x", 1, values)],
                ..Mesh::default()
            };
            assert_eq!(read_back(&mesh), Ok(mesh), "{length}");
        }
    }

    /// A file of some MB took a thousand times as much memory: each block was bounded, and not how many there are.
    #[test]
    fn a_file_that_would_take_much_memory_is_refused() {
        let mut block = ZlibEncoder::new(Vec::new(), Compression::fast());
        block.write_all(&vec![0; BLOCK]).unwrap();
        let block = block.finish().unwrap();
        let words = |words: &[usize]| -> Vec<u8> {
            let words = words.iter().flat_map(|&word| (word as u64).to_le_bytes());
            words.collect()
        };
        let blocks = 256;
        let header = words(&[&[blocks, BLOCK, 0][..], &vec![block.len(); blocks]].concat());
        let array = r#"<DataArray type="UInt8" Name="x" NumberOfComponents="1" format="appended" offset="0"/>"#;
        let file = |arrays: usize| {
            let head = format!("<VTKFile><Cells>{}</Cells>", array.repeat(arrays));
            let packed = [header.clone(), block.repeat(blocks)].concat();
            [head.as_bytes(), APPENDED, b"_", &packed].concat()
        };
        let largest = (UNPACKED / BLOCK as u64) as usize / blocks;
        assert_eq!(Mesh::from_file(&file(1)), Ok(Mesh::default()));
        let refused = Mesh::from_file(&file(largest + 1)).unwrap_err();
        assert!(refused.contains("too much memory"), "{refused}");
    }

    #[test]
    fn a_damaged_file_is_refused() {
        let whole = mesh().to_file(Precision::Double);
        for length in 0..whole.len() - b"\n</AppendedData>\n</VTKFile>".len() {
            assert!(Mesh::from_file(&whole[..length]).is_err(), "{length}");
        }
        for place in 0..whole.len() {
            let mut wrong = whole.clone();
            wrong[place] ^= 0xff;
            // Not every change can be detected, but none may cause more than an error.
            let _ = Mesh::from_file(&wrong);
        }
    }
}
