"""Chromium without a window, as it opens pages that the project writes."""

import shutil
import warnings
from pathlib import Path
from typing import Any

import pytest

KNOWN = (
    "cdn.tailwindcss.com should not be used in production",
    "The input spec uses Vega-Lite v3",
)
"""Warnings on what others have made: what Snakemake brings with every report."""

WIDE, PHONE = (1440, 1000), (390, 844)


def opened(size: tuple[int, int], folder: Path) -> Any:
    """Return a browser without a window, or skip the test where there is none."""
    missing = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    if missing:
        pytest.skip(f"{missing[0]} is not installed; on Debian: chromium and chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for word in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "hide-scrollbars"):
        options.add_argument(f"--{word}")
    options.add_argument(f"--user-data-dir={folder / 'chromium'}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    with warnings.catch_warnings():
        # Not ours: sockets that the driver leaves to be collected.
        warnings.simplefilter("ignore")
        driver = webdriver.Chrome(
            options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
        )
    resized(driver, size)
    return driver


def resized(driver: Any, size: tuple[int, int]) -> None:
    """Give the window a size [pixel]."""
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1}
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {**metrics, "mobile": size == PHONE}
    )


def complaints(driver: Any) -> list[str]:
    """Return what the browser has complained of since it was last asked."""
    entries = driver.get_log("browser")
    said = [str(each["message"]) for each in entries if each["level"] not in ("DEBUG", "INFO")]
    return [each for each in said if not any(known in each for known in KNOWN)]
