"""Live view in the browser: drag joints or the needle plan, see the verdict follow."""
