"""What the inspector looks at: digits, tolerance, plan and guidance, legible from afar."""
