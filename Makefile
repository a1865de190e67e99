# make demo    build FMUs, co-simulate, print a table, write a figure and a report
# make test    check style and types, run the tests; once more those that read recordings, with none to be found
# make test-slow    the same and the tests that take minutes
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test test-slow clean

demo: $(VENV)/installed
	$(BIN)/imufmu demo

test: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest -n auto --dist loadfile --durations=10
	IMUFMU_RECORDINGS=none $(BIN)/pytest -m recordings

test-slow: test
	$(BIN)/pytest -n auto --dist loadfile -m slow

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) imufmu-demo
