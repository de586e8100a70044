"""The page in Chromium, as people use it."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import PHONE, WIDE, complaints, opened
from explorer_synthetic import columns_of, made_up, many, saved

from softslip.provenance.export.csv_file import cells

pytestmark = pytest.mark.browser


class Explorer:
    """An open page."""

    def __init__(self, driver: Any, path: Path, fragment: str = "") -> None:
        self.driver = driver
        driver.get("about:blank")
        driver.get(f"{path.as_uri()}{fragment}")

    def ask(self, script: str, *words: Any) -> Any:
        return self.driver.execute_script(f"return {script}", *words)

    def text(self, selector: str) -> str:
        return str(self.ask("document.querySelector(arguments[0]).textContent", selector))

    def element(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def shown(self) -> int:
        return int(self.text("#count").split()[0])

    def complaints(self) -> list[str]:
        return complaints(self.driver)

    def click_point(self, plot: str, number: int = 0) -> int:
        """Click a point of a panel; return the run that it is of."""
        from selenium.webdriver import ActionChains

        points = self.driver.find_elements("css selector", f"#{plot} .scatterlayer .point")
        self.ask(
            "document.querySelector(arguments[0]).scrollIntoView({block: 'center'})", f"#{plot}"
        )
        ActionChains(self.driver).move_to_element(points[number]).click().perform()
        return int(self.ask("chosen.run"))


@pytest.fixture(scope="module")
def made() -> Any:
    return made_up(snapshots=(5.0, 25.0))


@pytest.fixture(scope="module")
def path(made: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    tables, runs = made
    # One run without a snapshot.
    bare = runs[0].drop_dims("snapshot")
    return saved(tmp_path_factory.mktemp("page"), tables, [bare, *runs[1:]])


@pytest.fixture(scope="module", params=[WIDE, PHONE], ids=["desktop", "phone"])
def driver(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Any]:
    started = opened(request.param, tmp_path_factory.mktemp("profile"))
    yield started
    started.quit()


def test_a_page_opens_without_complaint_and_loads_nothing(driver: Any, path: Path) -> None:
    page = Explorer(driver, path)
    assert page.shown() == 12
    assert page.complaints() == []
    assert page.ask("performance.getEntriesByType('resource').map((each) => each.name)") == []
    drawn = page.ask("[...document.querySelectorAll('.plot')].map((plot) => plot.data.length)")
    assert all(drawn)
    # Nothing is wider than the screen.
    assert page.ask("document.documentElement.scrollWidth <= innerWidth")


def test_filters_leave_the_runs_of_the_values_that_are_ticked(driver: Any, path: Path) -> None:
    page = Explorer(driver, path)
    page.ask("document.getElementById('controls').open = true")
    page.element("fieldset[name=stress] input").click()
    assert page.shown() == 8
    page.element("fieldset[name=seed] input").click()
    assert page.shown() == 4
    runs = page.ask(
        "document.getElementById('flow-curve').data.flatMap((each) => each.customdata ?? [])"
    )
    assert sorted(set(runs)) == page.ask("shownRuns()")
    page.element("fieldset[name=seed] .values-buttons button:nth-child(2)").click()
    assert page.shown() == 0
    page.element("fieldset[name=seed] .values-buttons button").click()
    assert page.shown() == 8
    assert page.complaints() == []


def test_a_click_on_a_point_shows_its_run(driver: Any, path: Path, made: Any) -> None:
    tables, runs = made
    page = Explorer(driver, path)
    names = page.ask("DATA.runs")
    run = page.click_point("flow-curve", 1)
    assert page.ask("location.hash") == f"#run={names[run]}"
    where = tables[0]["run_id"].values.ravel().tolist().index(names[run])
    # Its profile and its creep are those of the datasets, to the last bit.
    profile = page.ask("document.getElementById('run-profile').data[2].y")
    rows = tables[2]["normalised_velocity"].values.reshape(12, -1)
    assert profile == rows[where].tolist()
    creep = page.ask("document.getElementById('run-creep').data.map((each) => each.y)")
    for drawn, name in zip(creep, ("shear_rate_wall", "shear_rate_bulk"), strict=True):
        rate = tables[1][name].values.reshape(12, -1)[where]
        assert drawn == [value if value > 0 else None for value in rate.tolist()]
    origin = page.text("#run-origin")
    number = [each.run for each in runs].index(names[run])
    for part in (names[run], f"{number:064x}", "c0ffee"):
        assert part in origin
    assert page.complaints() == []


def test_numbers_are_written_as_export_writes_them(driver: Any, path: Path, made: Any) -> None:
    table = made[0][0]
    page = Explorer(driver, path, "#run=s0.2-b0.59-2")
    rows = page.ask(
        "[...document.querySelectorAll('#run-columns tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    cell = table.sel(stress=0.2, roughness=0.59, seed=2)
    expected = {name: cells(cell[name].values.reshape(1))[0] for name in columns_of(table)}
    assert {name: value for name, value, _ in rows} == expected
    hover = page.ask("document.getElementById('run-profile').data[2].text[3]")
    profile = made[0][2].sel(stress=0.2, roughness=0.59, seed=2).isel(normalised_position=3)
    names = ("normalised_position", "normalised_velocity", "normalised_velocity_error")
    values = [cells(profile[name].values.reshape(1))[0] for name in names]
    assert hover == f"y / H = {values[0]}<br>v<sub>norm</sub> = {values[1]} ± {values[2]}"


@pytest.mark.parametrize(
    "value", [0.0, -0.0, 1.0, 1e15, 1e16, 1.5e17, 1e-4, 9.999e-5, -2.5e-300, 5e-324, 0.1, 1e22]
)
def test_any_number_is_written_as_python_writes_it(driver: Any, path: Path, value: float) -> None:
    page = Explorer(driver, path)
    number = "new Float64Array(new Uint8Array(arguments[0]).buffer)[0]"
    assert page.ask(f"written({number})", list(struct.pack("<d", value))) == repr(value)


def test_a_snapshot_is_drawn_or_its_absence_said(driver: Any, path: Path) -> None:
    page = Explorer(driver, path, "#run=s0.2-b0.59-2")
    assert "t = 25.0" in page.text("#run-snapshot")
    shape = page.ask("document.querySelector('#run-snapshot .particles').getAttribute('d')")
    assert shape.count("M") == shape.count("Z") >= 20
    box = page.ask(
        "document.querySelector('#run-snapshot .particles').getBoundingClientRect().height"
    )
    assert box > 100
    page = Explorer(driver, path, "#run=s0.03-b0-1")
    assert page.text("#run-snapshot") == (
        "This run keeps no snapshots: its recording.snapshots is empty."
    )


def test_runs_are_reached_by_keyboard(driver: Any, path: Path) -> None:
    page = Explorer(driver, path, "#run=s0.2-b0-1")
    first = page.text("#run-title")
    page.element("#after").send_keys("\n")
    assert page.text("#run-title") != first
    page.element("#before").send_keys("\n")
    assert page.text("#run-title") == first
    unnamed = page.ask(
        "[...document.querySelectorAll('button, select, input')]"
        ".filter((each) => !each.getAttribute('aria-label') && !each.labels?.length"
        " && !each.textContent.trim()).map((each) => each.outerHTML)"
    )
    assert unnamed == [], "controls without a name"


def test_a_page_of_a_thousand_runs_opens_and_answers_clicks(made: Any, tmp_path: Path) -> None:
    tables, runs = made
    wide = [many(table, 84) for table in tables]
    names = wide[0]["run_id"].values.ravel().tolist()
    path = saved(tmp_path, wide, [runs[-1].assign_attrs(run=name) for name in names])
    driver = opened(WIDE, tmp_path)
    try:
        page = Explorer(driver, path)
        assert page.shown() == len(names) > 1000
        assert page.complaints() == []
        before = page.text("#run-title")
        page.click_point("slip", 40)
        assert page.text("#run-title") != before
    finally:
        driver.quit()
