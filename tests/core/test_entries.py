"""Entry points: found on the path as it is, in the order of their names."""

from borecheck.core.entries import entries


def installed(folder, name, text):
    metadata = folder / f"{name}-1.dist-info"
    metadata.mkdir(parents=True)
    about = f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n"
    (metadata / "METADATA").write_text(about)
    (metadata / "entry_points.txt").write_text(text)
    return str(folder)


def test_a_new_folder_of_the_path_is_seen(tmp_path, monkeypatch):
    group = "borecheck.test_entries"
    assert entries(group) == []
    first = installed(tmp_path / "a", "a", f"[{group}]\nlast = x:y\n")
    monkeypatch.syspath_prepend(first)
    assert [entry.name for entry in entries(group)] == ["last"]
    second = installed(tmp_path / "b", "b", f"[{group}]\nearly = x:y\n[o.p]\nz = x:y\n")
    monkeypatch.syspath_prepend(second)
    assert [entry.name for entry in entries(group)] == ["early", "last"]
