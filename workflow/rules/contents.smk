# What `snakemake --report` shows: the figures that are there, pages of tables beside them, the
# accuracy of the numerics where a published study is in the folder, and what is missing.

from softslip.files.products import FIGURES as EVERY_FIGURE, MOVIE as MOVING

# A report is of what is there, unless all is to be made before it is written.
ASKED = {word.split("=")[0] for word in sys.argv[1:]} if workflow.is_main_process else set()
REPORTING = bool({"--report", "--reporter"} & ASKED)
AS_IT_IS = REPORTING and "--report-after-run" not in ASKED

PUBLISHED = "results/published/numerics"

# Each page with what it is made from, its category, and what it shows.
PAGES_OF_REPORT = {
    "comparison": (
        f"{RESULTS}/comparison.nc",
        "Beside the paper",
        "numbers of the paper and ours",
    ),
    "movie": (f"{RESULTS}/figures/movie.mp4", "Figures", EVERY_FIGURE[MOVING].summary),
    "accuracy": (PUBLISHED, "Accuracy", "errors, costs and coverage"),
    "stability": (PUBLISHED, "Stability", "extremes and longest steps"),
}
FIGURES_OF_STUDY = {
    "validation": ("Accuracy", "errors against exact solutions"),
    "tradeoff": ("Accuracy", "error against cost"),
    "extrapolation": ("Accuracy", "rates without regularisation"),
    "stability_map": ("Stability", "what becomes of extreme runs"),
    "stability_limit": ("Stability", "longest stable steps"),
}


def is_there(path):
    """Whether there is such a file or folder, where the workflow has it."""
    return os.path.exists(located(path))


def wanted(results):
    """Return what is to be made, or what of it a report can show."""
    return [path for path in results if not AS_IT_IS or is_there(path)]


# Both are inputs of the rule `all`, so that captions are found from its file.
def page_of_report(name):
    """Write a page of the report now, and return it as the report shows it."""
    from softslip.operations.report.pages import write_page

    source, category, shows = PAGES_OF_REPORT[name]
    path = f"{RESULTS}/report/{name}.html"
    try:
        write_page(name, Path(located(source)), Path(located(path)))
    except SoftslipError as error:
        raise WorkflowError(str(error)) from None
    return report(
        path,
        caption=f"report/pages/{name}.rst",
        category=category,
        labels={"figure": name, "shows": shows},
    )


def figure_of_study(name):
    """Return a published figure as the report shows it."""
    category, shows = FIGURES_OF_STUDY[name]
    return report(
        f"{PUBLISHED}/{name}.png",
        caption=f"report/numerics/{name}.rst",
        category=category,
        labels={"figure": name, "shows": shows},
    )


def first_page_now():
    """Return the first page of a report on what there is when it is written, as HTML."""
    from softslip.operations.report.first_page import first_page

    return first_page(SCENARIO, PLACE, studied=is_there(PUBLISHED))


BESIDE_FIGURES = []
if REPORTING:
    # Called by ../report/workflow.rst, which knows nothing else of the workflow.
    config["first_page"] = first_page_now
    BESIDE_FIGURES += [
        page_of_report(name)
        for name, (source, *_) in PAGES_OF_REPORT.items()
        # What a run before the report may change would be shown as it was before the run.
        if is_there(source) and (AS_IT_IS or source == PUBLISHED)
    ]
    BESIDE_FIGURES += [
        figure_of_study(name) for name in FIGURES_OF_STUDY if is_there(f"{PUBLISHED}/{name}.png")
    ]
