//! mmCIF: what the format lets writers do is read alike, and what is wrong is named by line and column.

#![cfg(feature = "pdb")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use vertebra_files::FileError;
use vertebra_files::pdb::{self, Options, Protein};

const PEPTIDE: &str = include_str!("data/peptide.cif");

fn parse(text: &str) -> Result<Protein, FileError> {
    pdb::parse_mmcif(text, &Options::default())
}

/// The names of the file's columns and its rows.
fn table() -> (Vec<&'static str>, Vec<Vec<&'static str>>) {
    let columns = PEPTIDE.lines().filter(|line| line.starts_with('_'));
    let is_atom = |line: &&str| line.starts_with("ATOM") || line.starts_with("HETATM");
    let rows = PEPTIDE.lines().filter(is_atom);
    (
        columns.collect(),
        rows.map(|row| row.split_whitespace().collect()).collect(),
    )
}

/// A file of a table: the columns from line 3 on, then a row on each line.
fn written(columns: &[&str], rows: &[Vec<&str>]) -> String {
    let rows: Vec<String> = rows.iter().map(|row| row.join(" ")).collect();
    format!(
        "data_X\nloop_\n{}\n{}\n#\n",
        columns.join("\n"),
        rows.join("\n")
    )
}

/// The file with another value in a column of a row, both counted from 0.
fn with(row: usize, column: &str, value: &'static str) -> String {
    let (columns, mut rows) = table();
    let index = columns.iter().position(|name| name.ends_with(column));
    rows[row][index.unwrap()] = value;
    written(&columns, &rows)
}

/// Line of a row in what `written` writes.
fn line_of(row: usize) -> u32 {
    u32::try_from(3 + table().0.len() + row).unwrap()
}

#[track_caller]
fn refused(text: &str, line: impl Into<Option<u32>>, words: &[&str]) {
    let error = parse(text).unwrap_err();
    assert_eq!(error.location.line, line.into(), "{error}");
    for word in words {
        assert!(error.to_string().contains(word), "{word}: {error}");
    }
}

#[test]
fn what_the_format_allows_is_read_alike() {
    let expected = parse(PEPTIDE).unwrap().model.describe();
    let (columns, rows) = table();
    // Columns in another order, names in another case, other items around the table and comments in it,
    // one value a line, quotes around values, Windows' ends of lines.
    let backwards = |row: &[&'static str]| row.iter().copied().rev().collect::<Vec<_>>();
    let shuffled: Vec<Vec<&str>> = rows.iter().map(|row| backwards(row)).collect();
    let plain = written(&columns, &rows);
    let others = "data_X # a comment\n_cell.length_a ?\n_entry.title 'It''s ''quoted'\n_entity.text\n;GLY\nloop_\n;\nloop_\n_entity.id\n_entity.type\n1 polymer\n2 \"wa\"ter\"\n";
    let texts = [
        written(&backwards(&columns), &shuffled),
        plain
            .replace("_atom_site.", "_ATOM_Site.")
            .replace("loop_", "LOOP_"),
        plain.replacen("data_X\n", others, 1),
        plain.replace("\nATOM", " # the next\nATOM"),
        plain.replace("ATOM ", "ATOM\n").replace(" GLY ", " 'GLY' "),
        plain.replace('\n', "\r\n"),
        plain
            .replace(" 4.179 ", " 4.179(3) ")
            .replace(" 4.804 ", " +.4804e1 "),
        // Rows of a second model are left.
        written(
            &columns,
            &[
                rows.clone(),
                vec![{
                    let mut other = rows[1].clone();
                    *other.last_mut().unwrap() = "2";
                    other
                }],
            ]
            .concat(),
        ),
    ];
    for text in &texts {
        let read = parse(text).unwrap_or_else(|error| panic!("{error} in\n{text}"));
        assert_eq!(read.model.describe().bodies, expected.bodies, "{text}");
    }
    // Without the columns that another one can stand for.
    let without = |names: &[&str]| {
        let kept = |index: &usize| !names.iter().any(|name| columns[*index].ends_with(name));
        let kept: Vec<usize> = (0..columns.len()).filter(kept).collect();
        let pick = |row: &Vec<&'static str>| kept.iter().map(|&index| row[index]).collect();
        let rows: Vec<Vec<&str>> = rows.iter().map(pick).collect();
        parse(&written(&pick(&columns), &rows))
    };
    let spared = [
        ".id",
        ".group_PDB",
        "occupancy",
        "iso_or_equiv",
        "charge",
        "model_num",
    ];
    let author = [
        "auth_seq_id",
        "auth_asym_id",
        "auth_atom_id",
        "auth_comp_id",
    ];
    assert_eq!(
        without(&spared).unwrap().model.describe().bodies,
        expected.bodies
    );
    // The label of water's number is nothing, so that it must be that of its author.
    let error = without(&author).unwrap_err().to_string();
    assert!(
        error.contains("label_seq_id") && error.contains("found `.`"),
        "{error}"
    );
    for needed in ["Cartn_x", "Cartn_y", "Cartn_z", "type_symbol"] {
        let error = without(&[needed]).unwrap_err();
        assert_eq!(error.location.line, Some(3), "{error}");
        assert!(
            error.to_string().contains(&format!("no column `{needed}`")),
            "{error}"
        );
    }
    let error = without(&["seq_id"]).unwrap_err();
    assert!(
        error.to_string().contains("no column `auth_seq_id`"),
        "{error}"
    );
}

#[test]
fn values_that_are_none_are_named_by_row_and_column() {
    let x = "`_atom_site.Cartn_x` of row 6";
    for (value, found) in [
        ("abc", "found `abc`"),
        ("4,179", "found `4,179`"),
        ("?", "found `?`"),
        (".", "found `.`"),
        ("inf", "found `inf`"),
        ("nan", "found `nan`"),
        ("1e300", "found `1e300`"),
        ("99999999999", "found `99999999999`"),
        ("''", "found nothing"),
        ("4.179(", "found `4.179(`"),
    ] {
        refused(&with(5, "Cartn_x", value), line_of(5), &[x, found]);
    }
    let line = line_of(2);
    refused(
        &with(2, "auth_seq_id", "one"),
        line,
        &["auth_seq_id", "a whole number"],
    );
    refused(&with(2, "auth_seq_id", "1.5"), line, &["`1.5`"]);
    refused(
        &with(2, "type_symbol", "?"),
        line,
        &["type_symbol", "a value"],
    );
    // The author's name stands for that of the label.
    assert!(parse(&with(2, "label_atom_id", ".")).is_ok());
    refused(
        &with(2, "label_comp_id", "' '"),
        line,
        &["text in one line"],
    );
    refused(
        &with(2, "group_PDB", "ATM"),
        line,
        &["group_PDB", "ATOM or HETATM"],
    );
}

#[test]
fn tables_that_do_not_come_out_even_are_named_where_they_do_not() {
    let (columns, rows) = table();
    let mut long = rows.clone();
    long[5].push("7");
    // The value too many is where the next row starts.
    refused(
        &written(&columns, &long),
        line_of(5),
        &["row 7", "found `7`", "too many"],
    );
    let mut short = rows.clone();
    short[5].truncate(9);
    refused(
        &written(&columns, &short),
        line_of(6),
        &["of row 6", "must stand"],
    );
    let end = rows.len() - 1;
    let mut short = rows.clone();
    short[end].truncate(9);
    refused(
        &written(&columns, &short),
        line_of(end),
        &["9 values", "21 columns"],
    );
    refused(&written(&columns, &[]), 3, &["0 values", "21 columns"]);
    refused(
        &format!("{PEPTIDE}loop_\n_a.b\n_a.c\n1 2 3\n"),
        136,
        &["1 values", "2 columns"],
    );
    let twice = PEPTIDE.replacen("_atom_site.Cartn_y", "_atom_site.Cartn_x", 1);
    refused(&twice, 15, &["Cartn_x", "taken already, on line 14"]);
    let foreign = PEPTIDE.replacen("_atom_site.occupancy", "_other.occupancy", 1);
    refused(&foreign, 17, &["`_other.occupancy`"]);
    refused(
        &format!("{PEPTIDE}{}", &PEPTIDE["data_PEPTIDE\n".len()..]),
        134,
        &["keep one"],
    );
}

#[test]
fn other_blocks_and_empty_tables_are_passed_over() {
    let expected = parse(PEPTIDE).unwrap().model.describe();
    let table = &PEPTIDE["data_PEPTIDE\n".len()..];
    for text in [
        // Refinement programs append the ligands they used.
        format!("{PEPTIDE}data_comp_HOH\nloop_\n_chem_comp_atom.atom_id\nO H1 H2\n"),
        format!("data_comp_list\n_chem_comp.id HOH\n{PEPTIDE}"),
        // Of two structures the first counts.
        format!("{PEPTIDE}data_Y\nloop_\n_atom_site.id\n1\n"),
        format!("data_X\nloop_\n_audit.a\n_audit.b\n{table}"),
        format!("{PEPTIDE}loop_\n_audit.a\n"),
        // Words that only start as reserved ones do.
        format!("data_X\n_a.b stop_codon\n_a.c Global_search\n_a.d loop_1\n{table}"),
        // Values in quotes, all on one line.
        format!(
            "data_X\nloop_\n_a.b\n{}\n{table}",
            "'a'b' \"c\"d\" ".repeat(20_000)
        ),
    ] {
        let read = parse(&text).unwrap_or_else(|error| panic!("{error} in\n{text:.200}"));
        assert_eq!(read.model.describe().bodies, expected.bodies, "{text:.200}");
    }
    for word in ["STOP_", "global_", "save_", "Save_frame"] {
        refused(&format!("data_X\n_a.b {word}\n"), 2, &["found", word]);
    }
    refused("data_X\n_a.b 'c\n_a.d 'e'\n", 2, &["quotes"]);
    refused("data_X\ndata_Y\n_a.b c\n", None, &["has no atoms"]);
}

/// Many columns, many residues, and insertion codes in lower case, of residues that the rows go back to.
#[test]
fn residues_are_gathered_by_chain_number_and_insertion_code() {
    let (columns, rows) = table();
    let index = |name: &str| columns.iter().position(|c| c.ends_with(name)).unwrap();
    let (code, number) = (index("ins_code"), index("auth_seq_id"));
    let mut inserted = rows.clone();
    for row in inserted.iter_mut().filter(|row| row[number] == "7") {
        (row[number], row[code]) = ("6", "b");
    }
    let read = parse(&written(&columns, &inserted)).unwrap();
    let plain = parse(PEPTIDE).unwrap();
    let of = |protein: &Protein, id: &str| protein.atoms.iter().filter(|a| a.residue == id).count();
    assert!(of(&plain, "A:7") > 3);
    assert_eq!(of(&read, "A:6B"), of(&plain, "A:7"));
    assert_eq!(of(&read, "A:6"), of(&plain, "A:6"));
    assert_eq!(read.left_out, plain.left_out);
    // Half of the atoms of every residue, then the other half.
    let (even, odd): (Vec<_>, Vec<_>) = (0..rows.len()).partition(|row| row % 2 == 0);
    let split: Vec<_> = [even, odd]
        .concat()
        .into_iter()
        .map(|row| rows[row].clone())
        .collect();
    let read = parse(&written(&columns, &split)).unwrap();
    assert_eq!(read.atoms.len(), plain.atoms.len());
    assert_eq!(read.left_out, plain.left_out);
    let mut many = written(&columns, &rows);
    let waters: String = (0..20_000)
        .map(|water| {
            let mut row = rows[rows.len() - 1].clone();
            let water = (1_000 + water).to_string();
            row[number] = &water;
            row.join(" ") + "\n"
        })
        .collect();
    many.push_str(&waters);
    let many = parse(&many).unwrap();
    assert_eq!(many.left_out.len(), plain.left_out.len() + 20_000);
    let foreign: Vec<String> = (0..10_000)
        .map(|i| format!("_atom_site.column_{i}"))
        .collect();
    let foreign = format!("data_X\nloop_\n{}\n1\n", foreign.join("\n"));
    refused(&foreign, 3, &["no column `Cartn_x`"]);
}

#[test]
fn texts_that_are_something_else_are_named_as_such() {
    refused("", 1, &["the end of the text", "`data_`"]);
    refused("# nothing\n\n", 3, &["`data_`"]);
    refused("data_X\n", None, &["has no atoms"]);
    refused(
        "data_X\nloop_\n_entity.id\n1 2 3\n",
        None,
        &["has no atoms"],
    );
    refused(include_str!("data/peptide.pdb"), 1, &["found `TITLE`"]);
    refused(include_str!("data/rover.sdf"), 1, &["found `<?xml`"]);
    refused("loop_\n_atom_site.id\n1\n", 1, &["found `loop_`"]);
    refused("data_X\n_atom_site.Cartn_x 1.0\n", 2, &["`loop_`"]);
    refused("data_X\nsave_a\n_b.c 1\nsave_\n", 2, &["found `save_a`"]);
    refused("data_X\n1 2 3\n", 2, &["found `1`"]);
    refused("data_X\nloop_\n1 2 3\n", 2, &["names of its columns"]);
    refused("data_X\n_a.b\nloop_\n_c.d 1\n", 3, &["`_a.b`", "its value"]);
    refused("data_X\n_a.b", 2, &["`_a.b`", "the end of the text"]);
    refused("data_X\n_a.b 'open\n_a.c 1\n", 2, &["quotes"]);
    refused("data_X\n_a.b\n;open\nmore\n", 3, &["a line `;`"]);
    let file = std::env::temp_dir().join("vertebra-broken-structure.cif");
    std::fs::write(&file, with(5, "Cartn_x", "?")).unwrap();
    let error = pdb::read(&file, &Options::default())
        .unwrap_err()
        .to_string();
    let place = format!("{}:{}: ", file.display(), line_of(5));
    assert!(error.starts_with(&place), "{error}");
    std::fs::remove_file(file).unwrap();
}
